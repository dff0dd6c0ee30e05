"""The settings of a run of the conveyor. Settings that all tasks share are in `drake_tracker.scenarios.base`."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.arm.config import HandKind, PacketGuardConfig, Puma560, ServoConfig
from drake_tracker.arm.description import ARMS, arms_without
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.core.setting import setting
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.dispatch.config import CycleTime, Eligibility, LookAhead, PickWindow
from drake_tracker.dispatch.dispatcher import DISPATCHERS
from drake_tracker.estimation.config import Belt
from drake_tracker.faults.config import EncoderJump, EncoderStopped, HandOverBelt, ImageFaultConfig
from drake_tracker.faults.kinds import faults_of
from drake_tracker.grasp.config import PickConfig
from drake_tracker.link.config import Perfect
from drake_tracker.link.link import LINKS
from drake_tracker.measured.config import MeasuredParts
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.vision.parts.config import BeltParts
from drake_tracker.world.config import CamerasConfig, LightingConfig, WristCamera
from drake_tracker.world.conveyor.conveyor_config import ArrivalsConfig, BeltConfig, TrayConfig


@dataclass(frozen=True)
class ConveyorServoConfig(ServoConfig):
    """The fixed-gain filter of the trajectory generator. Parts on a belt keep their direction, so that it need not be
    followed more quickly during the descent."""

    descent_yaw_tracking_index: ClassVar[float] = 0.003
    """The same as yaw_tracking_index, during the descent to a part; chosen."""


@dataclass(frozen=True)
class BeltCamerasConfig(CamerasConfig):
    """The two fixed cameras, which look down on the belt from beyond it, past the hand."""

    width: int = setting(320, "image width", "px", (16, 2048))
    height: int = setting(224, "image height", "px", (16, 2048))
    fov_deg: float = setting(32.0, "vertical field of view", "deg", (2.0, 120.0))
    distance: float = setting(1.5, "distance of both cameras from look_at", "m", (0.3, 5.0))
    azimuth_deg: tuple[float, ...] = setting(
        [35.0, -35.0], "azimuths of the left and the right camera", "deg", (-180.0, 180.0), shape=(2,)
    )
    elevation_deg: float = setting(50.0, "elevation of both cameras above look_at", "deg", (1.0, 89.0))
    look_at: tuple[float, ...] = setting(
        [0.60, 0.0, 0.46], "point at which both cameras look", "m", (-2.0, 3.0), shape=(3,)
    )
    calibration: str = setting("conveyor_cameras.yaml", "file with the calibrated camera models")


@dataclass(frozen=True)
class Rendered:
    """Vision on rendered images of both cameras."""

    parts: BeltParts = setting(BeltParts, "how parts are found and tracked")
    lag_cycles: int = setting(
        15, "time from the capture of an image to the parts in it", "cycles", (1, 120), shared=True
    )
    update_cycles: int = setting(2, "time from one pair of images to the next", "cycles", (1, 30))


@dataclass(frozen=True)
class Measured(MeasuredParts):
    """Measured vision: the true poses plus random errors. No image is rendered."""


@dataclass(frozen=True)
class ConveyorScenario(BaseScenario):
    """All settings of a run of the conveyor.

    Attributes:
        hand: the hand that the task needs.
        eligibility: which parts may be picked.
    """

    COMMON: ClassVar[tuple[str, ...]] = (
        *("duration", "seed", "belt.speed", "belt.motion", "belt.encoder"),
        *("arrivals.rate", "arrivals.pattern", "arrivals.gap", "arrivals.touching", "tray.columns", "tray.rows"),
        *("lighting.shadows", "cameras.noise", "cameras.calibration", "cameras.render_processes"),
        *("vision", "vision.lag_cycles", "dispatch", "dispatch.horizon"),
        *("window.y_first", "window.y_last", "window.y_wait", "link", "link.drop", "link.delay"),
        *("pick.hover_height", "pick.lift_height", "arm", "faults"),
    )
    hand: ClassVar[HandKind] = HandKind.GRIPPER
    task: str = setting("conveyor", "name of the task")
    belt: BeltConfig = setting(BeltConfig, "the belt")
    arrivals: ArrivalsConfig = setting(ArrivalsConfig, "the parts that it brings")
    tray: TrayConfig = setting(TrayConfig, "the trays")
    lighting: LightingConfig = setting(LightingConfig, "the lamps")
    cameras: BeltCamerasConfig = setting(BeltCamerasConfig, "the two fixed cameras")
    vision: Rendered | Measured = setting(Rendered, "from the belt to the poses of the parts on it")
    estimator: Belt = setting(Belt, "from poses to predicted paths")
    dispatch: DISPATCHERS.union() = setting(LookAhead, "which part is picked next")  # type: ignore[valid-type]
    eligibility: ClassVar[Eligibility] = Eligibility()
    window: PickWindow = setting(PickWindow, "where parts may be picked")
    cycle: CycleTime = setting(CycleTime, "the dispatcher's model of the durations of the arm")
    link: LINKS.union() = setting(  # type: ignore[valid-type]
        Perfect, "from the host to the controller of the arm"
    )
    guard: PacketGuardConfig = setting(PacketGuardConfig, "which packets the arm follows")
    servo: ConveyorServoConfig = setting(
        ConveyorServoConfig, "from packets of predicted path to set-points every 30 ms"
    )
    pick: PickConfig = setting(PickConfig, "motions of the hand, and their conditions")
    arm: ARMS.union(Custom, without=arms_without(HandKind.GRIPPER)) = setting(  # type: ignore[valid-type]
        Puma560, "the arm"
    )
    faults: tuple[faults_of("conveyor"), ...] = setting([], "injected faults, with their times")  # type: ignore[valid-type]

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key path, what is required)."""
        found = self.timing_problems(SERVO_PERIOD)
        if self.window.y_first >= self.window.y_last:
            found.append(("window.y_first", "must be less than window.y_last"))
        if self.window.y_last > self.belt.end:
            found.append(("window.y_last", "must be at most belt.end, where parts are missed"))
        if self.tray.cell >= self.tray.pitch:
            found.append(("tray.cell", f"must be less than {self.tray.pitch:g} m, or there is no room for the walls"))
        widest = max(shape.width for shape in PART_SHAPES.values())
        if self.pick.jaw_opening <= widest:
            found.append(("pick.jaw_opening", f"must be more than {widest:g} m, the width of the widest part"))
        if self.belt.entry >= self.window.y_last:
            found.append(("belt.entry", "must be less than window.y_last, or no part could be picked"))
        if isinstance(self.cameras.wrist, WristCamera):
            found.append(("cameras.wrist", "must be !NoWristCamera: the hand carries no camera in this task"))
        for number, fault in enumerate(self.faults):
            where, name = f"faults[{number}]", type(fault).__name__
            if isinstance(fault, EncoderJump | EncoderStopped) and not self.belt.encoder:
                found.append((where, f"!{name} needs an encoder: set belt.encoder=true"))
            if isinstance(fault, HandOverBelt | ImageFaultConfig) and isinstance(self.vision, Measured):
                found.append((where, f"!{name} needs cameras: vision must be !Rendered"))
            if getattr(fault, "camera", "both") == "wrist":
                found.append((f"{where}.camera", "must be left, right or both: the hand has no camera"))
        return found
