"""The settings of a run of the conveyor. Settings that all tasks share are in `drake_tracker.scenarios.base`."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.arm.config import Hand, PacketGuardConfig, Puma560, ServoConfig
from drake_tracker.arm.kinds import ARMS, arms_without
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.core.setting import setting
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.dispatch.config import CycleTime, Eligibility, LookAhead, Window
from drake_tracker.dispatch.kinds import DISPATCHERS
from drake_tracker.estimation.config import Belt
from drake_tracker.grasp.config import PickConfig
from drake_tracker.link.config import Perfect
from drake_tracker.link.kinds import LINKS
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.vision.config import MeasuredParts
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.conveyor_config import ArrivalsConfig, BeltConfig, TrayConfig


@dataclass(frozen=True)
class ConveyorServoConfig(ServoConfig):
    """The fixed-gain filter of the trajectory generator. Parts on a belt keep their direction, so that it need not be
    followed more quickly during the descent."""

    descent_yaw_tracking_index: float = setting(
        0.003, "the same as yaw_tracking_index, during the descent to a part", "", (0.0001, 10.0)
    )


@dataclass(frozen=True)
class ConveyorScenario(BaseScenario):
    """All settings of a run of the conveyor.

    Attributes:
        hand: the hand that the task needs.
        belt: the belt.
        arrivals: the parts that it brings.
        tray: the trays.
        lighting: the lamps.
        cameras: the two fixed cameras.
        vision: from the belt to the poses of the parts on it.
        estimator: from poses to predicted paths.
        dispatch: which part is picked next.
        eligibility: which parts may be picked.
        window: where parts may be picked.
        cycle: what the dispatcher knows about the time that the arm takes.
        link: from the host to the controller of the arm.
        guard: which packets the arm follows.
        servo: from packets of predicted path to set-points every 30 ms.
        pick: what the hand does, and when.
        arm: the arm.
    """

    hand: ClassVar[Hand] = Hand.GRIPPER
    task: str = setting("conveyor", "name of the task")
    belt: BeltConfig = setting(BeltConfig, "the belt")
    arrivals: ArrivalsConfig = setting(ArrivalsConfig, "the parts that it brings")
    tray: TrayConfig = setting(TrayConfig, "the trays")
    lighting: LightingConfig = setting(LightingConfig, "the lamps")
    cameras: CamerasConfig = setting(CamerasConfig, "the two fixed cameras")
    vision: MeasuredParts = setting(MeasuredParts, "from the belt to the poses of the parts on it")
    estimator: Belt = setting(Belt, "from poses to predicted paths")
    dispatch: DISPATCHERS.union() = setting(LookAhead, "which part is picked next")  # type: ignore[valid-type]
    eligibility: Eligibility = setting(Eligibility, "which parts may be picked")
    window: Window = setting(Window, "where parts may be picked")
    cycle: CycleTime = setting(CycleTime, "what the dispatcher knows about the time that the arm takes")
    link: LINKS.union() = setting(  # type: ignore[valid-type]
        Perfect, "from the host to the controller of the arm"
    )
    guard: PacketGuardConfig = setting(PacketGuardConfig, "which packets the arm follows")
    servo: ConveyorServoConfig = setting(
        ConveyorServoConfig, "from packets of predicted path to set-points every 30 ms"
    )
    pick: PickConfig = setting(PickConfig, "what the hand does, and when")
    arm: ARMS.union(Custom, without=arms_without(Hand.GRIPPER)) = setting(  # type: ignore[valid-type]
        Puma560, "the arm"
    )

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key path, what is required)."""
        found = self.timing_problems(SERVO_PERIOD)
        if self.window.y_first >= self.window.y_last:
            found.append(("window.y_first", "must be less than window.y_last"))
        if self.window.y_last > self.belt.end:
            found.append(("window.y_last", "must be at most belt.end, where parts are missed"))
        if self.tray.cell >= self.tray.pitch:
            found.append(("tray.cell", "must be less than tray.pitch, or there is no room for the walls"))
        widest = max(shape.width for shape in PART_SHAPES.values())
        if self.pick.jaw_opening <= widest:
            found.append(("pick.jaw_opening", f"must be more than {widest:g} m, the width of the widest part"))
        if self.belt.entry >= self.window.y_last:
            found.append(("belt.entry", "must be less than window.y_last, or no part could be picked"))
        if not sum(self.arrivals.mix) > 0.0:
            found.append(("arrivals.mix", "must be positive for at least one kind of part"))
        return found
