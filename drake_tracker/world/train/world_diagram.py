"""The laboratory of the train as a Diagram: everything that is real, and the only place that holds the ground truth."""

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.arm_faults_system import add_joint_faults
from drake_tracker.faults.fault import Fault, SceneFault, faults_at
from drake_tracker.world.config import CamerasConfig, LightingConfig, NoEvent
from drake_tracker.world.disturbance_system import add_scene_faults
from drake_tracker.world.imaging.camera_system import close_cameras, start_cameras
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.imaging.faulty_cameras_system import add_faulty_cameras
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.objects_system import add_object_motion, add_object_states
from drake_tracker.world.prismatic_actuator import add_moving_body
from drake_tracker.world.robot_ports_diagram import add_jaw_sensor, export_robot_ports
from drake_tracker.world.scene_object import Ride, SceneObject
from drake_tracker.world.train.grasp_judge_system import add_grasp_judge
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_laboratory, hide_table_frame, place_train
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.speed_law import SpeedEvent
from drake_tracker.world.train.track_visual import add_track_visual
from drake_tracker.world.train.tracks import Track


class WorldDiagram(Diagram):
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
        description: the arm and its gripper.
        q_initial: joints at the start [rad].
        track: in the direction of travel.
        start: arc length at which the train starts [m].
        body: which of the train models, one of `TRAIN_BODIES`.
        scale: length of the train relative to its model.
        colour: main colour of the train, "#rrggbb"; empty: that of the model.
        start_delay: time until which the train stands [s].
        table_height: height of the table's top in W [m].
        table_colour: mean colour of the table's top, "#rrggbb"; empty: that of the model.
        speed: mean speed of the train [m/s].
        speed_law: how the speed varies, one of `SPEED_LAWS`.
        variation: amplitude of a varying speed as a fraction of ``speed``.
        event: sudden change of the train's speed. One that waits for the launch adds the input ``launch``, an
            `ArmCommand`.
        grip_force: largest force on each pad [N].
        jaw_opening: opening of the jaws at the start [m].
        cameras: where the cameras stand, their images and their noise.
        lighting: the lamps.
        windows: {camera name: window} to render; None renders the full images. When it is empty there are no cameras,
            no ``camera_*`` ports and no renderer.
        pipeline: how late the images are, and which processes make them; None: they are rendered when they are read.
        objects: further objects that move by themselves.
        judge_all: whether the judge watches the trains among ``objects`` too; without it, only the first train.
        faults: what goes wrong; of these, the world has those of images, scene, train, joints and gripper.
        seed: of the sensor noise.
        time_step: of the plant [s].

    Attributes:
        laboratory: the plant and its parts: ground truth.
        cameras: {name: Camera}.
        image_latency: cycles from the capture of an image until its port shows it.
    """

    def __init__(
        self,
        *,
        description: ArmDescription,
        q_initial: Sequence[float] | np.ndarray,
        track: Track,
        start: float = 0.0,
        body: str = "plain",
        scale: float = 1.0,
        colour: str = "",
        start_delay: float = 0.0,
        table_height: float = 0.45,
        table_colour: str = "",
        speed: float = 0.15,
        speed_law: str = "constant",
        variation: float = 0.15,
        event: SpeedEvent | NoEvent = NoEvent(),
        grip_force: float = 25.0,
        jaw_opening: float = 0.088,
        cameras: CamerasConfig = CamerasConfig(),
        lighting: LightingConfig = LightingConfig(),
        windows: Mapping[str, ImageWindow] | None = None,
        pipeline: ImagePipeline | None = None,
        objects: Sequence[SceneObject] = (),
        judge_all: bool = False,
        faults: Sequence[Fault] = (),
        seed: int = 0,
        time_step: float = TIME_STEP,
    ) -> None:
        super().__init__()
        self.set_name("world")
        builder = DiagramBuilder()

        def decorate(plant: MultibodyPlant) -> None:
            add_track_visual(plant, track=track, table_height=table_height)
            for fault in faults_at(faults, SceneFault):
                add_moving_body(plant, fault.body)

        laboratory = add_laboratory(
            builder,
            description=description,
            body=body,
            scale=scale,
            colour=colour,
            table_height=table_height,
            table_colour=table_colour,
            time_step=time_step,
            grip_force=grip_force,
            objects=objects,
            decorate=decorate,
        )
        plant = laboratory.plant
        plant.set_name("plant")
        plant.SetDefaultPositions(laboratory.arm, q_initial)
        plant.SetDefaultPositions(laboratory.gripper, [0.5 * jaw_opening, 0.5 * jaw_opening])
        place_train(laboratory, track=track, s=start, table_height=table_height)
        rest_height = table_height + TRAIN_HEIGHT
        forces = [add_object_motion(builder, plant=plant, moving=each) for each in objects]
        rail = add_rail(
            builder,
            plant=plant,
            train=laboratory.train,
            track=track,
            height=rest_height,
            speed=speed,
            speed_law=speed_law,
            variation=variation,
            start_delay=start_delay,
            scale=scale,
            event=event,
            faults=faults,
            others=[port for port in forces if port is not None],
        )
        if rail.HasInputPort("launch"):
            builder.ExportInput(rail.GetInputPort("launch"), "launch")
        add_scene_faults(builder, plant=plant, faults=faults)
        add_joint_faults(builder, plant=plant, arm=laboratory.arm, faults=faults)
        self.laboratory = laboratory
        self.image_latency = 0 if pipeline is None else pipeline.latency
        if windows and (0, 0, cameras.width, cameras.height) not in windows.values():
            hide_table_frame(laboratory)
        self.cameras = add_faulty_cameras(
            builder,
            laboratory=laboratory,
            tool_frame=description.tool_frame,
            config=cameras,
            lighting=lighting,
            windows=windows,
            pipeline=pipeline,
            faults=faults,
            seed=seed,
        )
        jaws = add_jaw_sensor(builder, plant=plant, gripper=laboratory.gripper)
        others = [
            (body, each.motion.track)
            for body, each in zip(laboratory.object_bodies, objects)
            if isinstance(each.motion, Ride) and judge_all
        ]
        judge = add_grasp_judge(builder, laboratory=laboratory, track=track, rest_height=rest_height, others=others)

        export_robot_ports(
            builder,
            laboratory=laboratory,
            cameras=self.cameras,
            jaws=jaws,
            jaw_opening=jaw_opening,
            faults=faults,
        )
        builder.ExportOutput(plant.get_state_output_port(laboratory.train), "truth_train_state")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        if others:
            builder.ExportOutput(judge.GetOutputPort("judged"), "truth_judged")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        if objects:
            states = add_object_states(builder, plant=plant, bodies=laboratory.object_bodies)
            builder.ExportOutput(states.GetOutputPort("states"), "truth_object_states")
        builder.BuildInto(self)

    def start(self) -> None:
        """Starts the processes that make images, if there are any, which otherwise start with the first image."""
        start_cameras(self.cameras.values())

    def close(self) -> None:
        """Ends the processes that make images, if there are any. They start again when an image is read."""
        close_cameras(self.cameras.values())
