"""Settings of the arms and of the trajectory generator. The name of an arm's class is its YAML tag."""

from dataclasses import dataclass
from enum import Enum

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class ServoConfig:
    """The fixed-gain filter of the trajectory generator.

    Attributes:
        tracking_index: tracking index of the position, the ratio of manoeuvre noise to measurement noise. At 0.01 the
            filter lags by 1 mm in a bend at 0.2 m/s.
        yaw_tracking_index: tracking index of the direction, which is noisier and changes more steadily.
        stale_after: time [s] without a new packet after which the target counts as stale.
    """

    tracking_index: float = setting(0.01, "ratio of manoeuvre noise to measurement noise, position", "", (0.001, 10.0))
    yaw_tracking_index: float = setting(
        0.003, "ratio of manoeuvre noise to measurement noise, direction", "", (0.0001, 10.0)
    )
    stale_after: float = setting(0.2, "age of the newest packet from which the target is stale", "s", (0.03, 10.0))


@dataclass(frozen=True)
class Puma560:
    """The PUMA 560, the arm of the 1991 laboratory. It has a gripper or a cup."""


@dataclass(frozen=True)
class SevenJoint:
    """An arm with seven joints, with the kinematics of the Robotics Research K-1607. It has a cup."""


class Hand(Enum):
    """The hand at the end of an arm; a task needs one of them."""

    GRIPPER = "gripper"
    CUP = "cup"
