"""Faults of the arm and the gripper: a sticking joint, a slow gripper, a weak gripper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.fault import GripperFault, JointFault

SLOWEST_SLIP = 0.01
"""Speed [rad/s] from which the whole friction acts; below it, friction is proportional to the speed."""


@dataclass(frozen=True)
class StickingJointFault(JointFault):
    """`StickingJoint`: a torque against the motion of a joint.

    It is proportional to the speed up to a slip speed and constant beyond. The slip speed is large enough for the
    explicit step of the simulation: the torque of one step takes away at most half of the joint's speed.

    Attributes:
        servo_inertia: inertia that each joint moves [kg m^2].
        time_step: of the plant [s].

    Raises DrakeTrackerError when the arm has no such joint.
    """

    servo_inertia: Sequence[float] = ()
    time_step: float = TIME_STEP

    def __post_init__(self) -> None:
        count = len(self.servo_inertia)
        if self.settings.joint > count:
            raise DrakeTrackerError(
                f"faults[{self.number}].joint is {self.settings.joint}; the joints of this arm are 1 to {count}"
            )

    def torques(self, v: np.ndarray) -> np.ndarray:
        joint, friction = self.settings.joint - 1, self.settings.friction
        slip = max(SLOWEST_SLIP, 2.0 * friction * self.time_step / self.servo_inertia[joint])
        torques = np.zeros(len(v))
        torques[joint] = -friction * np.clip(v[joint] / slip, -1.0, 1.0)
        return torques


@dataclass(frozen=True)
class SlowGripperFault(GripperFault):
    """`SlowGripper`: the set-point of the driven finger, half the opening, changes slowly."""

    def set_point(self, desired: np.ndarray, before: float, position: float, time_step: float) -> np.ndarray:
        rate = 0.5 * self.settings.speed
        step = float(np.clip(desired[0] - before, -rate * time_step, rate * time_step))
        return np.array([before + step, np.clip(desired[1], -rate, rate)])


@dataclass(frozen=True)
class WeakGripperFault(GripperFault):
    """`WeakGripper`: the set-point stays so close to the finger that the drive, a spring, has little force.

    Attributes:
        finger_stiffness: of the drive [N/m]; both pads share its force.
    """

    finger_stiffness: float = 5000.0

    def set_point(self, desired: np.ndarray, before: float, position: float, time_step: float) -> np.ndarray:
        reach = 2.0 * self.settings.force / self.finger_stiffness
        return np.array([position + np.clip(desired[0] - position, -reach, reach), 0.0])
