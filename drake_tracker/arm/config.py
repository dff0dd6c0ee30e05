"""Settings of the arms and their trajectory generator. The name of an arm's class is its YAML tag."""

from dataclasses import dataclass
from enum import Enum

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class ServoConfig:
    """The trajectory generator's own filter."""

    tracking_index: float = setting(0.01, "manoeuvre noise over measurement noise, position", "", (0.001, 10.0))
    yaw_tracking_index: float = setting(0.003, "the same, direction", "", (0.0001, 10.0))
    stale_after: float = setting(0.2, "age of the newest packet at which it says it is stale", "s", (0.03, 10.0))


@dataclass(frozen=True)
class Puma560:
    """The arm of the 1991 laboratory."""


@dataclass(frozen=True)
class SevenJoint:
    """An arm with seven joints, with the kinematics of the Robotics Research K-1607."""


class Hand(Enum):
    """The hand at the end of an arm; a task needs one of them."""

    GRIPPER = "gripper"
    CUP = "cup"
