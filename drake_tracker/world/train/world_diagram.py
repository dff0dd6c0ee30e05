"""The laboratory of the train as a Diagram: everything that is real, and the only place that holds the ground truth."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.faults.fault import SceneFault, faults_at
from drake_tracker.world.base_world_diagram import BaseWorldDiagram, WorldConfig
from drake_tracker.world.config import CamerasConfig, TrackConfig, TrainConfig
from drake_tracker.world.imaging.faulty_cameras_system import add_faulty_cameras
from drake_tracker.world.objects_system import add_object_motion, add_object_states
from drake_tracker.world.prismatic_actuator import add_moving_body
from drake_tracker.world.scene_object import Ride, SceneObject
from drake_tracker.world.train.grasp_judge_system import add_grasp_judge
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_laboratory, hide_table_frame, place_train
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.track_visual import add_track_visual
from drake_tracker.world.train.tracks import Track


class WorldDiagram(BaseWorldDiagram):
    """Plant, rail, cameras, jaw sensor and judge of the train.

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
        - truth_object_states

    Inputs: ``arm_desired_state``, the joint set-points (q, v) [rad, rad/s]; ``arm_feedforward``, torques [N m];
    ``gripper_desired_state``, (q, v) [m, m/s] of the driven finger.

    The controller may read ``camera_left`` and ``camera_right``, each an ImageRgba8U that is rendered when it is read,
    or that was captured some cycles earlier (``pipeline``);
    ``arm_state``, (q, v) [rad, rad/s]; ``arm_effort``, the torques of the drives [N m]; and ``jaws``, a `JawState`.
    Only judges, logs and viewers may read ``truth_train_state``, the 13 numbers of the free body; ``truth_verdict``, a
    `Verdict`, updated at 60 Hz from time 0 and all zeros before; ``truth_query``, the scene; and
    ``truth_object_states``, 13 numbers of a free body for each of ``objects``, which exists only if there are any.
    A hand with a camera (``cameras.wrist``) adds ``camera_wrist``, an image of the same kind, for the controller.
    With ``judge_all`` and further trains there is also ``truth_judged``, the number of the train that the verdict is
    about: 0 for the first, k for the k-th train of ``objects``.

    Args:
        config: common settings of all laboratories. Faults of images, scene, train, joints and gripper take effect.
        track: in the direction of travel.
        start: arc length at which the train starts [m].
        motion: how fast the train runs. Its sudden change may wait for the launch; this adds the input ``launch``, an
            `ArmCommand`.
        train: its appearance, its length, and when it starts.
        table_height: height of the table's top in W [m].
        table_colour: mean colour of the table's top, "#rrggbb"; empty: the colour of the model.
        cameras: where the cameras stand, their images and their noise.
        objects: further objects that move by themselves.
        judge_all: whether the judge watches the trains among ``objects`` too; without it, only the first train.

    Attributes: see `BaseWorldDiagram`.
    """

    def __init__(
        self,
        config: WorldConfig,
        *,
        track: Track,
        start: float = 0.0,
        motion: TrackConfig = TrackConfig(),
        train: TrainConfig = TrainConfig(),
        table_height: float = 0.45,
        table_colour: str = "",
        cameras: CamerasConfig = CamerasConfig(),
        objects: Sequence[SceneObject] = (),
        judge_all: bool = False,
    ) -> None:
        super().__init__(config)
        builder = DiagramBuilder()
        faults = config.faults

        def decorate(plant: MultibodyPlant) -> None:
            add_track_visual(plant, track=track, table_height=table_height)
            for fault in faults_at(faults, SceneFault):
                add_moving_body(plant, fault.body)

        self.laboratory = laboratory = add_laboratory(
            builder,
            description=config.arm,
            body=train.body,
            scale=train.scale,
            colour=train.colour,
            table_height=table_height,
            table_colour=table_colour,
            time_step=config.time_step,
            grip_force=config.grip_force,
            objects=objects,
            decorate=decorate,
        )
        plant = laboratory.plant
        self.place_robot(config)
        place_train(laboratory, track=track, s=start, table_height=table_height, turns=motion.turns)

        # Drive the trains and objects.
        rest_height = table_height + TRAIN_HEIGHT
        forces = [add_object_motion(builder, plant=plant, moving=each) for each in objects]
        rail = add_rail(
            builder,
            plant=plant,
            train=laboratory.train,
            ride=Ride(
                track,
                start,
                motion.speed,
                motion.speed_law,
                motion.variation,
                train.start_delay,
                train.scale,
                motion.event,
                train.body,
                motion.turns,
            ),
            height=rest_height,
            faults=faults,
            others=[port for port in forces if port is not None],
        )
        if rail.HasInputPort("launch"):
            builder.ExportInput(rail.GetInputPort("launch"), "launch")
        self.add_faults(builder, config)

        self.check_layout()

        # Look at the scene.
        windows = config.windows
        if windows and (0, 0, cameras.width, cameras.height) not in windows.values():
            hide_table_frame(laboratory)
        self.cameras = add_faulty_cameras(builder, laboratory=laboratory, config=config, cameras=cameras)

        # Judge what happens to the train, or to every train.
        others = [
            (body, each.motion.track)
            for body, each in zip(laboratory.object_bodies, objects)
            if isinstance(each.motion, Ride) and judge_all
        ]
        judge = add_grasp_judge(
            builder,
            laboratory=laboratory,
            track=track,
            rest_height=rest_height,
            others=others,
            turns=motion.turns,
        )

        self.export_robot(builder, config)
        builder.ExportOutput(plant.get_state_output_port(laboratory.train), "truth_train_state")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        if others:
            builder.ExportOutput(judge.GetOutputPort("judged"), "truth_judged")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        if objects:
            states = add_object_states(builder, plant=plant, bodies=laboratory.object_bodies)
            builder.ExportOutput(states.GetOutputPort("states"), "truth_object_states")
        builder.BuildInto(self)
