"""The arithmetic of an action: a pose of the tool, or its velocity, becomes a goal of the transform equation."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from drake_tracker.arm.arm_model import ArmModel, tool_yaw
from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import Frozen, ServoTarget, message_size
from drake_tracker.grasp.jaws import next_opening
from drake_tracker.grasp.operator_override import resting_target

HOLD, POSE, VELOCITY = 0.0, 1.0, 2.0
"""Modes of a *command*, a vector of six elements: pose (x, y, z, yaw) in W of the tool [m, rad], or its rates [m/s,
rad/s]; opening of the jaws [m]; mode. With ``HOLD``, or all zeros, the goal and the jaws stay."""


@dataclass(frozen=True)
class ActionState(FrozenState):
    """All that the machine remembers.

    Attributes:
        goal: pose (x, y, z, yaw) in W of the tool, read-only, shape (4,) [m, rad]; None before the first tick.
        jaw_width: opening of the jaws that is asked for [m].
        time: time of the last tick [s].
    """

    goal: np.ndarray | None
    jaw_width: float
    time: float = 0.0


class ActionMachine:
    """Arithmetic of a hand that an action moves, in place of a grasp machine.

    The hand does not plan: each goal is due at once. The inverse kinematics and the joint limiter bound its speed.

    Args:
        model: the controller's model of the arm.
        period: time between ticks [s].
        jaw_opening: largest opening of the jaws [m], 0 without jaws.
        jaw_speed: largest rate at which the opening changes [m/s].
    """

    def __init__(self, model: ArmModel, period: float, jaw_opening: float, jaw_speed: float) -> None:
        self.model, self.period, self.jaw_opening, self.jaw_speed = model, period, jaw_opening, jaw_speed

    def initial_state(self) -> ActionState:
        """Returns the state of a hand that waits with open jaws."""
        return ActionState(None, self.jaw_opening)

    def update(self, state: ActionState, seen: Any) -> ActionState:
        """Returns the state after a tick.

        Args:
            state: the state before.
            seen: has ``time`` [s], ``q_commanded`` (the last set-points (n,) [rad]) and ``action`` (a command). A
                velocity moves the goal away from the set-points, so that a hand that a limit stops is free as soon as
                the velocity changes its sign.
        """
        goal, width, mode = state.goal, state.jaw_width, seen.action[5]
        if mode == POSE:
            goal = seen.action[:4].copy()
        elif mode == VELOCITY or goal is None:
            goal = flat_pose(self.model.tool_pose(seen.q_commanded)) + self.period * seen.action[:4]
        if mode != HOLD:
            asked = np.clip(seen.action[4], 0.0, self.jaw_opening)
            width = next_opening(width, asked, self.jaw_speed, self.period)
        return ActionState(read_only(goal), float(width), seen.time)

    def command(self, state: ActionState) -> np.ndarray:
        """Returns the `ArmCommand` vector of a state: a motion of one period in the frame of the goal.

        The tool is at the goal when this motion ends, which is at once. ``GUIDED`` locks the half turns of the jaws.
        """
        return np.array([0, 0, self.period, MotionFrame.GOAL, 0.0, Frozen.GUIDED, state.jaw_width], dtype=float)

    def goal_target(self, state: ActionState) -> np.ndarray:
        """Returns the `ServoTarget` vector of the goal; not valid before the first tick."""
        return np.zeros(message_size(ServoTarget)) if state.goal is None else resting_target(state.time, state.goal)


def flat_pose(X_WT: RigidTransform) -> np.ndarray:
    """Returns the pose (x, y, z, yaw) in W of a tool that points down, shape (4,) [m, rad]."""
    return np.array([*X_WT.translation(), tool_yaw(X_WT)])
