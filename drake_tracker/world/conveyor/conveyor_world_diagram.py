"""The laboratory of the conveyor as a Diagram: everything that is real, and the only place with the ground truth."""

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.arm_faults_system import add_joint_faults
from drake_tracker.faults.fault import Fault, SceneFault, faults_at
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.belt_system import add_belt_drive
from drake_tracker.world.conveyor.conveyor_config import BeltConfig, TrayConfig
from drake_tracker.world.conveyor.conveyor_plant import add_conveyor_laboratory
from drake_tracker.world.conveyor.pick_judge_system import add_pick_judge
from drake_tracker.world.conveyor.sleeping_parts import SleepingParts, free_stretch
from drake_tracker.world.disturbance_system import add_scene_faults
from drake_tracker.world.imaging.camera_system import close_cameras, start_cameras
from drake_tracker.world.imaging.cameras import ImageWindow, true_camera_models
from drake_tracker.world.imaging.faulty_cameras_system import add_faulty_cameras
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.objects_system import add_object_states
from drake_tracker.world.robot_ports_diagram import add_jaw_sensor, export_robot_ports


class ConveyorWorldDiagram(Diagram):
    """Plant, belt drive, cameras, jaw sensor and judge of the conveyor.

    .. pydrake_system::

        name: ConveyorWorldDiagram
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
        - encoder
        - truth_part_states
        - truth_verdict
        - truth_fates
        - truth_query

    Inputs: ``arm_desired_state``, the joint set-points (q, v) [rad, rad/s]; ``arm_feedforward``, torques [N m];
    ``gripper_desired_state``, (q, v) [m, m/s] of the driven finger.

    The controller may read ``camera_left`` and ``camera_right``, each an ImageRgba8U that is rendered when it is read,
    or that was captured some cycles earlier (``pipeline``); ``arm_state``, (q, v) [rad, rad/s]; ``arm_effort``, the
    torques of the drives [N m]; ``jaws``, a `JawState`; and ``encoder``, an `EncoderReading`, which exists only if the
    belt has an encoder. A hand with a camera (``cameras.wrist``) adds ``camera_wrist``, an image of the same kind. Only
    judges, logs and viewers may read ``truth_part_states``, the 13 numbers of the free body of each part;
    ``truth_verdict``, a `PickVerdict`, and ``truth_fates``, one `PartFate` for each part, both updated at 60 Hz from
    time 0 and all zeros before; and ``truth_query``, the scene.

    Args:
        description: an arm with a gripper.
        q_initial: joints at the start [rad].
        arrivals: the parts, at least one, for example from `draw_arrivals`.
        duration: of the run, for which the belt is long enough [s].
        belt: where the belt lies, and how it moves.
        tray: the trays.
        grip_force: largest force on each pad [N].
        jaw_opening: opening of the jaws at the start [m].
        cameras: where the cameras stand, their images and their noise.
        lighting: the lamps.
        windows: {camera name: window} to render; None renders the full images. When it is empty there are no cameras,
            no ``camera_*`` ports and no renderer.
        pipeline: how late the images are, and which processes make them; None: they are rendered when they are read.
        faults: what goes wrong; of these, the world has those of images, scene, encoder, joints and gripper.
        seed: of the sensor noise.
        time_step: of the plant [s].

    Attributes:
        laboratory: the plant and its parts: ground truth.
        arrivals: the parts: ground truth.
        motion: of the belt: ground truth.
        cameras: {name: Camera}.
        image_latency: cycles from the capture of an image until its port shows it.
    """

    def __init__(
        self,
        *,
        description: ArmDescription,
        q_initial: Sequence[float] | np.ndarray,
        arrivals: Sequence[Arrival],
        duration: float,
        belt: BeltConfig = BeltConfig(),
        tray: TrayConfig = TrayConfig(),
        grip_force: float = 25.0,
        jaw_opening: float = 0.088,
        cameras: CamerasConfig = CamerasConfig(),
        lighting: LightingConfig = LightingConfig(),
        windows: Mapping[str, ImageWindow] | None = None,
        pipeline: ImagePipeline | None = None,
        faults: Sequence[Fault] = (),
        seed: int = 0,
        time_step: float = TIME_STEP,
    ) -> None:
        super().__init__()
        self.set_name("world")
        builder = DiagramBuilder()
        self.arrivals = tuple(arrivals)
        self.motion = make_belt_motion(belt)
        laboratory = add_conveyor_laboratory(
            builder,
            description=description,
            belt=belt,
            tray=tray,
            motion=self.motion,
            arrivals=self.arrivals,
            duration=duration,
            time_step=time_step,
            grip_force=grip_force,
            bodies=[fault.body for fault in faults_at(faults, SceneFault)],
        )
        self.laboratory = laboratory
        plant = laboratory.plant
        plant.set_name("plant")
        plant.SetDefaultPositions(laboratory.arm, q_initial)
        plant.SetDefaultPositions(laboratory.gripper, [0.5 * jaw_opening, 0.5 * jaw_opening])
        drive = add_belt_drive(builder, plant=plant, belt=laboratory.belt, motion=self.motion, faults=faults)
        add_scene_faults(builder, plant=plant, faults=faults)
        add_joint_faults(builder, plant=plant, arm=laboratory.arm, faults=faults)
        self.image_latency = 0 if pipeline is None else pipeline.latency
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
        states = add_object_states(builder, plant=plant, bodies=laboratory.parts, name="part_states")
        judge = add_pick_judge(
            builder,
            laboratory=laboratory,
            part_states=states.GetOutputPort("states"),
            arrivals=self.arrivals,
            belt=belt,
            tray=tray,
        )

        export_robot_ports(
            builder,
            laboratory=laboratory,
            cameras=self.cameras,
            jaws=jaws,
            jaw_opening=jaw_opening,
            faults=faults,
        )
        if belt.encoder:
            builder.ExportOutput(drive.GetOutputPort("encoder"), "encoder")
        builder.ExportOutput(states.GetOutputPort("states"), "truth_part_states")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        builder.ExportOutput(judge.GetOutputPort("fates"), "truth_fates")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        builder.BuildInto(self)
        seen = {name: true_camera_models(cameras)[name] for name in self.cameras}
        stretch = free_stretch(belt, seen, windows)
        self._holder = SleepingParts(laboratory, self.arrivals, belt, self.motion, stretch)

    def between_steps(self, root_context: Context) -> None:
        """Holds the parts that nothing can move; to be called between two steps, once per vision cycle.

        Without these calls all parts are free all the time: a run is slower, and places differ by some micrometres.

        Args:
            root_context: of the whole diagram. Parameters and state of the plant are changed.
        """
        fates = self.GetOutputPort("truth_fates").Eval(self.GetMyContextFromRoot(root_context))
        self._holder.update(self.laboratory.plant.GetMyMutableContextFromRoot(root_context), fates)

    def start(self) -> None:
        """Starts the processes that make images, if there are any, which otherwise start with the first image."""
        start_cameras(self.cameras.values())

    def close(self) -> None:
        """Ends the processes that make images, if there are any. They start again when an image is read."""
        close_cameras(self.cameras.values())
