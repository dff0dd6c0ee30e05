"""The laboratory as a Diagram: everything that is real, and the only place where truth lives."""

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.world.cameras import add_cameras
from drake_tracker.world.jaw_sensor_system import JawSensorSystem
from drake_tracker.world.judge_system import JudgeSystem
from drake_tracker.world.plant import TRAIN_HEIGHT, add_laboratory, place_train
from drake_tracker.world.rail_system import add_rail
from drake_tracker.world.track_visual import add_track_visual


class WorldDiagram(Diagram):
    """Plant, rail and cameras.

    .. pydrake_system::

        name: WorldDiagram
        input_ports:
        - arm_desired_state
        - arm_feedforward
        - gripper_desired_state
        output_ports:
        - camera_left
        - camera_right
        - arm_state
        - arm_effort
        - jaws
        - truth_train_state
        - truth_verdict
        - truth_query

    Inputs: joint set-points (q, v), feed-forward torques [N m], and (q, v) of the driven finger. ``camera_*`` are
    ImageRgba8U at 60 Hz, ``arm_state`` is (q, v), ``jaws`` a `JawState`: these may be read by the controller.
    ``arm_effort``, the drives' torques [N m], is logged. The ``truth_*`` ports are for judges, logs and viewers alone.

    Args:
      scenario: a TrainScenario. description: an `ArmDescription`. q_initial: the arm's start [rad].
      track: a `Track`. start: arc length [m] at which the train starts.
      windows: {camera name: (u0, v0, width, height)} to render, None for whole images; empty for no cameras at all, and
      then without the ports ``camera_*`` and without a renderer.
    """

    def __init__(self, scenario, description, q_initial, track, start, windows=None):
        super().__init__()
        self.set_name("world")
        builder = DiagramBuilder()
        laboratory = add_laboratory(
            builder,
            description,
            scenario.train.body,
            scenario.table_height,
            scenario.time_step,
            decorate=lambda plant: add_track_visual(plant, track, scenario.table_height),
            grip_force=scenario.grasp.grip_force,
        )
        plant = laboratory.plant
        plant.set_name("plant")
        plant.SetDefaultPositions(laboratory.arm, q_initial)
        opening = 0.5 * scenario.grasp.jaw_opening
        plant.SetDefaultPositions(laboratory.gripper, [opening, opening])
        place_train(laboratory, track, start, scenario.table_height)
        add_rail(
            builder,
            plant,
            laboratory.train,
            track,
            scenario.table_height + TRAIN_HEIGHT,
            speed=scenario.track.speed,
            speed_law=scenario.track.speed_law,
            variation=scenario.track.variation,
        )
        self.cameras = {}
        if windows is None or windows:
            self.cameras = add_cameras(
                builder,
                laboratory.scene_graph,
                scenario.cameras,
                scenario.lighting,
                windows=windows,
                seed=scenario.seed,
            )
        jaws = builder.AddNamedSystem("jaw_sensor", JawSensorSystem())
        builder.Connect(plant.get_state_output_port(laboratory.gripper), jaws.GetInputPort("gripper_state"))
        builder.Connect(plant.get_net_actuation_output_port(laboratory.gripper), jaws.GetInputPort("drive_effort"))
        judge = builder.AddNamedSystem("judge", JudgeSystem(laboratory, track, scenario.table_height, TRAIN_HEIGHT))
        builder.Connect(plant.get_contact_results_output_port(), judge.GetInputPort("contact_results"))
        builder.Connect(plant.get_state_output_port(laboratory.train), judge.GetInputPort("train_state"))

        builder.ExportInput(plant.get_desired_state_input_port(laboratory.arm), "arm_desired_state")
        builder.ExportInput(plant.get_actuation_input_port(laboratory.arm), "arm_feedforward")
        builder.ExportInput(plant.get_desired_state_input_port(laboratory.gripper), "gripper_desired_state")
        for name, camera in self.cameras.items():
            builder.ExportOutput(camera.image_port, name)
        builder.ExportOutput(plant.get_state_output_port(laboratory.arm), "arm_state")
        builder.ExportOutput(plant.get_net_actuation_output_port(laboratory.arm), "arm_effort")
        builder.ExportOutput(jaws.GetOutputPort("jaws"), "jaws")
        builder.ExportOutput(plant.get_state_output_port(laboratory.train), "truth_train_state")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        self.laboratory = laboratory
        builder.BuildInto(self)
