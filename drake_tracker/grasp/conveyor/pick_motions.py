"""The motions of the hand between belt and cells: directions of the tool, angles of the last joint, durations."""

import math
from typing import Any

import numpy as np

from drake_tracker.arm.arm_model import ArmModel, tool_yaw
from drake_tracker.arm.motion.differential_ik import LIMIT_MARGIN, SPEED_SHARE
from drake_tracker.arm.motion.tool_yaw import swing_about_base
from drake_tracker.arm.motion.transform_equation import PEAK_OVER_MEAN, straight_motion_time
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.grasp.config import PickConfig
from drake_tracker.grasp.conveyor.pick_schema import PickObservation

WRIST_MARGIN = 2.0 * LIMIT_MARGIN
"""Distance [rad] from the end of its range at which the last joint may end a motion."""
JAW_TURNS = 2
"""Number of directions of the jaws that are equivalent by symmetry."""


class PickMotions:
    """Arithmetic of the motions of the `PickMachine`.

    Args:
        config: speeds and acceleration of the hand.
        model: the controller's model of the arm.
    """

    def __init__(self, config: PickConfig, model: ArmModel) -> None:
        self.config, self.model = config, model

    def place_yaw(self, order: Any, place: np.ndarray, seen: PickObservation) -> float:
        """Returns the direction of the tool [rad] in which the part lies as ordered: of the directions that the last
        joint can reach, the direction nearest to the present direction.

        The part turns with the hand, whose half turns about it count when it was taken. A part with rotational symmetry
        may be put down in several directions. A part without a direction is put down with the jaws along the ordered
        one or against it, so that they open where there is room beside the neighbours.

        Args:
            order: a `PickOrder`.
            place: of the cell, shape (3,) [m].
            seen: the inputs of the arm's computer.
        """
        turns = PART_SHAPES[PartKind(int(order.kind))].turns or JAW_TURNS
        now, step = float(seen.status.yaw), 2.0 * math.pi / turns
        wanted = order.place_yaw + math.pi * seen.status.branch
        nearest = now + math.remainder(wanted - now, step)
        other = nearest - math.copysign(step, nearest - now)
        lowest, highest = self.model.position_lower[-1] + WRIST_MARGIN, self.model.position_upper[-1] - WRIST_MARGIN
        return nearest if lowest <= self.wrist_at(place, nearest, seen) <= highest else other

    def measured_tool(self, seen: PickObservation) -> tuple[np.ndarray, float]:
        """Returns where the tool is: p_WT, shape (3,) [m], and its direction, within half a turn of the commanded one
        [rad]."""
        X_WT = self.model.tool_pose(seen.arm_state[: self.model.num_joints])
        commanded = float(seen.status.yaw)
        return X_WT.translation(), commanded + math.remainder(tool_yaw(X_WT) - commanded, 2.0 * math.pi)

    def wrist_at(self, p_WO: np.ndarray, yaw: float, seen: PickObservation) -> float:
        """Returns the angle of the last joint [rad] when the tool, which points down, is at a place.

        Args:
            p_WO: the place, shape (3,) [m].
            yaw: direction of the tool there, continuous [rad].
            seen: the inputs of the arm's computer.
        """
        p_WT, now = self.measured_tool(seen)
        return float(seen.arm_state[self.model.num_joints - 1]) + swing_about_base(p_WT, p_WO) + now - yaw

    def duration(
        self, displacement: np.ndarray, wrist: float, v_WT: np.ndarray, v_WO: np.ndarray, seen: PickObservation
    ) -> float:
        """Returns the duration of a motion to a place that may move [s].

        Args:
            displacement: the place minus the tool, shape (3,) [m].
            wrist: angle of the last joint there [rad].
            v_WT: velocity of the tool at the start, shape (3,) [m/s].
            v_WO: velocity of the place, shape (3,) [m/s].
            seen: the inputs of the arm's computer.
        """
        config, n = self.config, self.model.num_joints
        time = way_time(displacement, v_WT, v_WO, config.hand_speed, config.hand_acceleration)
        turn_speed = min(config.hand_turn_speed, SPEED_SHARE * float(self.model.velocity_limit[-1]))
        turn = PEAK_OVER_MEAN * abs(wrist - float(seen.arm_state[n - 1])) / turn_speed
        return max(time, turn, config.shortest_motion)

    def unwound(self, p_WO: np.ndarray, yaw: float, seen: PickObservation) -> float:
        """Returns the angle of the last joint [rad] at a place to which the empty hand goes: jaws may turn by half
        turns on the way, and end nearest to the middle of the joint's range.

        Args:
            p_WO: the place, shape (3,) [m].
            yaw: direction of the object there [rad].
            seen: the inputs of the arm's computer.
        """
        return math.remainder(self.wrist_at(p_WO, yaw, seen), math.pi)


def way_time(displacement: np.ndarray, v_WT: np.ndarray, v_WO: np.ndarray, speed: float, acceleration: float) -> float:
    """Returns the duration of a motion of the hand to a place that may move [s].

    The motion is planned in the frame of the place. If the place comes towards the hand, the hand is slower in the
    world than in the moving frame, and may be faster in the moving frame by the difference.

    Args:
        displacement: the place minus the hand, shape (3,) [m].
        v_WT: velocity of the hand at the start, shape (3,) [m/s].
        v_WO: velocity of the place, shape (3,) [m/s].
        speed: largest speed of the hand [m/s].
        acceleration: its largest acceleration [m/s^2].
    """
    length = float(np.linalg.norm(displacement))
    coming = max(0.0, -float(v_WO @ displacement)) / length if length > 0.0 else 0.0
    return straight_motion_time(displacement, v_WT - v_WO, speed + coming, acceleration)
