"""The laboratory of the conveyor as a Diagram: everything that is real, and the only place with the ground truth."""

from collections.abc import Sequence

from pydrake.systems.framework import Context, DiagramBuilder

from drake_tracker.faults.fault import SceneFault, faults_at
from drake_tracker.world.base_world_diagram import BaseWorldDiagram, WorldConfig
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.belt_system import add_belt_drive
from drake_tracker.world.conveyor.conveyor_config import BeltConfig, TrayConfig
from drake_tracker.world.conveyor.conveyor_plant import add_conveyor_laboratory
from drake_tracker.world.conveyor.pick_judge_system import add_pick_judge
from drake_tracker.world.conveyor.sleeping_parts import SleepingParts, free_stretch
from drake_tracker.world.imaging.cameras import true_camera_models
from drake_tracker.world.imaging.faulty_cameras_system import add_faulty_cameras
from drake_tracker.world.objects_system import add_object_states


class ConveyorWorldDiagram(BaseWorldDiagram):
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
        config: common settings of all laboratories. Faults of images, scene, encoder, joints and gripper take effect.
        arrivals: the parts, at least one, for example from `draw_arrivals`.
        duration: of the run, for which the belt is long enough [s].
        belt: where the belt lies, and how it moves.
        tray: the trays.
        cameras: where the cameras stand, their images and their noise.

    Attributes: see `BaseWorldDiagram`, and
        arrivals: the parts: ground truth.
        motion: of the belt: ground truth.
    """

    def __init__(
        self,
        config: WorldConfig,
        *,
        arrivals: Sequence[Arrival],
        duration: float,
        belt: BeltConfig = BeltConfig(),
        tray: TrayConfig = TrayConfig(),
        cameras: CamerasConfig = CamerasConfig(),
    ) -> None:
        super().__init__(config)
        builder = DiagramBuilder()
        self.arrivals = tuple(arrivals)
        self.motion = make_belt_motion(belt)
        self.laboratory = laboratory = add_conveyor_laboratory(
            builder,
            description=config.arm,
            belt=belt,
            tray=tray,
            motion=self.motion,
            arrivals=self.arrivals,
            duration=duration,
            time_step=config.time_step,
            grip_force=config.grip_force,
            bodies=[fault.body for fault in faults_at(config.faults, SceneFault)],
        )
        plant = laboratory.plant
        self.place_robot(config)
        self.check_layout()
        drive = add_belt_drive(builder, plant=plant, belt=laboratory.belt, motion=self.motion, faults=config.faults)
        self.add_faults(builder, config)
        self.cameras = add_faulty_cameras(builder, laboratory=laboratory, config=config, cameras=cameras)
        states = add_object_states(builder, plant=plant, bodies=laboratory.parts, name="part_states")
        judge = add_pick_judge(
            builder,
            laboratory=laboratory,
            part_states=states.GetOutputPort("states"),
            arrivals=self.arrivals,
            belt=belt,
            tray=tray,
        )

        self.export_robot(builder, config)
        if belt.encoder:
            builder.ExportOutput(drive.GetOutputPort("encoder"), "encoder")
        builder.ExportOutput(states.GetOutputPort("states"), "truth_part_states")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        builder.ExportOutput(judge.GetOutputPort("fates"), "truth_fates")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        builder.BuildInto(self)
        seen = {name: true_camera_models(cameras)[name] for name in self.cameras}
        stretch = free_stretch(belt, seen, config.windows)
        self._holder = SleepingParts(laboratory, self.arrivals, belt, self.motion, stretch)

    def between_steps(self, root_context: Context) -> None:
        """Holds the parts that nothing can move; to be called between two steps, once per vision cycle.

        Without these calls all parts are free all the time: a run is slower, and places differ by some micrometres.

        Args:
            root_context: of the whole diagram. Parameters and state of the plant are changed.
        """
        fates = self.GetOutputPort("truth_fates").Eval(self.GetMyContextFromRoot(root_context))
        self._holder.update(self.laboratory.plant.GetMyMutableContextFromRoot(root_context), fates)
