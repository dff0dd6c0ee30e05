"""Straight-line motions of the tool relative to the object, one after the other without a jump of speed."""

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from drake_tracker.arm.motion.tool_yaw import (
    FLIP_SPEED,
    best_branch,
    flip_duration,
    must_flip,
    nearest_whole_turn,
    swing_about_base,
)
from drake_tracker.arm.motion.transform_equation import (
    LEVEL,
    Drive,
    Slope,
    apply_drive,
    share_done,
    shrink_drive,
    slope_along,
    solve_drive,
    surface_normal,
)
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import Frozen


class MotionFrame(IntEnum):
    """The frame in which a motion is straight: values of `ArmCommand`'s ``frame`` field.

    `GOAL` is at rest where the decision wants the hand, whatever the object does. The hand is vertical above a goal. If
    the goal is the pose of the tool itself, with a height of 0, the hand keeps its slope.
    """

    HOME = 0
    OBJECT = 1
    HELD = 2
    GOAL = 3


JUMP_DISTANCE, JUMP_ANGLE = 0.03, 0.35
"""A reference that moves by more than this [m], [rad] in one period is approached anew instead of followed."""
GUIDED_JUMP = 0.10
"""The same distance in a guided descent [m]. There is no time for a new approach, and the object is the same."""
SLOPE_RATE = 5.0
"""Natural frequency [rad/s] of the critically damped filter of a path's slope. The slope of a packet errs by 3 to
4 deg, and changes by 1 deg from packet to packet; chosen on seeds 74200 and 74201."""


@dataclass(frozen=True)
class ToolMotionState(FrozenState):
    """State of the commanded tool and of its motion.

    Poses are (x, y, z, yaw) in W [m, rad], yaw continuous, and the slope of the surface to which they are square.

    Attributes:
        tool: commanded pose of the tool, shape (6,).
        previous_tool: the same one tick earlier.
        reference: pose of the reference that the tool moves relative to, shape (6,).
        previous_reference: the same one tick earlier.
        motion: counter of the motion under way, as in `ArmCommand`.
        frame: frame of the motion under way.
        start: time at which the motion began [s].
        drive: value of Drive when the motion began.
        drive_rate: its rate when the motion began, per second.
        branch: half turns between jaws and reference.
        previous_branch: the same before the flip under way.
        flip_start: time at which the flip began [s], minus infinity when there was none.
        flip_duration: duration of the flip [s].
        fraction: completed fraction of the motion's time, 0 to 1.
        path_slope: filtered slope of the object's path, and its rate per second, shape (4,).
    """

    tool: np.ndarray
    previous_tool: np.ndarray
    reference: np.ndarray
    previous_reference: np.ndarray
    motion: float
    frame: MotionFrame
    start: float
    drive: Drive
    drive_rate: Drive
    branch: int
    previous_branch: int
    flip_start: float
    flip_duration: float
    fraction: float
    path_slope: np.ndarray


class ToolMotion:
    """Arithmetic of the hand's straight-line motions.

    Args:
        home: reference pose (x, y, z, yaw) in W, shape (4,) [m, rad], over which the hand waits without an object.
        period: time between ticks [s].
        symmetric: whether half a turn about the approach leaves the hand as it is; otherwise the hand never flips.
        moving: whether the object moves by itself, so that the last step of its reference is its speed. A goal that is
            corrected from time to time does not move.
        swings: whether a motion goes so far about the base that the arm's first joint turns the hand. Then the branch
            is the best branch at the end of the motion, not at its beginning.
        flip_speed: speed of the last joint that a flip may use [rad/s].
        slope: of the surface on which objects move, to which the tool is square; None: the slope of the object's path,
            as its velocity tells, to which the tool tilts in a descent. A tilted hand that hovered would be in front of
            the cameras. The surface is level across the path, because vision does not measure a bank.
    """

    def __init__(
        self,
        home: np.ndarray,
        period: float,
        symmetric: bool = True,
        moving: bool = True,
        swings: bool = False,
        flip_speed: float = FLIP_SPEED,
        slope: Slope | None = LEVEL,
    ) -> None:
        self.slope = slope
        self.home = np.array([*home, *(LEVEL if slope is None else slope)])
        self.period = period
        self.symmetric, self.moving, self.swings, self.flip_speed = symmetric, moving, swings, flip_speed

    def initial_state(self, p_WT: np.ndarray, yaw: float) -> ToolMotionState:
        """Returns the state of a tool that stands still at p_WT [m] with its x axis at ``yaw`` [rad], as square as over
        ``home``."""
        tool = np.array([*p_WT, yaw, *self.home[4:]])
        still = Drive(np.zeros(3), 0.0)
        home, slope = self.home, np.array([*self.home[4:], *LEVEL])
        return ToolMotionState(
            tool, tool, home, home, -1.0, MotionFrame.HOME, 0.0, still, still, 0, 0, -np.inf, 1.0, 1.0, slope
        )

    def update(self, state: ToolMotionState, time: float, command: Any, target: Any, q6: float) -> ToolMotionState:
        """Returns the state after a tick.

        Args:
            state: the state before.
            time: time of the tick [s].
            command: an `ArmCommand`. While it is ``frozen`` the jaws are locked and do not flip.
            target: a `ServoTarget`: of the object or, in the frame `MotionFrame.GOAL`, of the goal.
            q6: set-point of joint 6 [rad] that belongs to the tool pose of the last tick.
        """
        state = self._follow_reference(state, command, target)
        if command.motion != state.motion or self._jumped(state, command):
            state = self._begin(state, time, command, target, q6)
        elif self._may_flip(state, time, command) and must_flip(self._last_joint(state, q6)):
            state = self._flip(state, time, q6, target.yaw_rate)
        duration = max(command.duration, self.period)
        fraction = min((time - state.start) / duration, 1.0)
        drive = shrink_drive(state.drive, state.drive_rate, fraction, duration)
        p_WG, yaw_G = self._grasp_frame(state.reference, command.height, self._half_turns(state, time))
        p_WT, yaw_T, slope_T = apply_drive(drive, p_WG, yaw_G, state.reference[4:])
        return replace(state, tool=np.array([*p_WT, yaw_T, *slope_T]), previous_tool=state.tool, fraction=fraction)

    def flipping(self, state: ToolMotionState, time: float) -> bool:
        """Returns whether the jaws are flipping at a time [s]."""
        return state.branch != state.previous_branch and time < state.flip_start + state.flip_duration

    def _follow_reference(self, state: ToolMotionState, command: Any, target: Any) -> ToolMotionState:
        frame = MotionFrame(int(command.frame))
        if frame == MotionFrame.HOME:
            reference = self.home
        elif frame in (MotionFrame.OBJECT, MotionFrame.GOAL) and target.valid:
            if frame == MotionFrame.OBJECT:
                state = self._filter_slope(state, target)
            slope = self._slope(state, frame, command)
            reference = np.array([target.x, target.y, target.z, target.yaw, *slope])
        else:
            reference = state.reference
        if frame != state.frame:  # a new frame has no past: assume that it has moved as its pose moves now
            past = reference.copy()
            if frame == MotionFrame.OBJECT and target.valid:
                past -= self._step(target)
        else:
            past = state.reference.copy()
        past[4:] = reference[4:]  # the rate of the slope is the tool's own
        return replace(state, reference=reference, previous_reference=past, frame=frame)

    def _filter_slope(self, state: ToolMotionState, target: Any) -> ToolMotionState:
        """Returns the state with the slope of the path of a target followed by one period."""
        if self.slope is not None:
            return state
        if state.frame != MotionFrame.OBJECT:
            state = replace(state, path_slope=np.array([*state.tool[4:], *LEVEL]))
        value, rate = state.path_slope[:2], state.path_slope[2:]
        error = slope_along(np.array([target.vx, target.vy, target.vz]), value) - value
        rate = rate + self.period * SLOPE_RATE * (SLOPE_RATE * error - 2.0 * rate)
        return replace(state, path_slope=np.concatenate([value + self.period * rate, rate]))

    def _slope(self, state: ToolMotionState, frame: MotionFrame, command: Any) -> Slope:
        """Returns the slope to which the tool shall be square in the frame of the object or of a goal."""
        if frame == MotionFrame.OBJECT:
            if self.slope is not None:
                return self.slope
            return LEVEL if command.frozen == Frozen.FREE else state.path_slope[:2]
        if command.height != 0.0:
            return LEVEL
        return state.reference[4:] if frame == state.frame else state.tool[4:]

    def _jumped(self, state: ToolMotionState, command: Any) -> bool:
        """Returns whether the reference moved farther in one period than an object does: vision lost it, and found it
        again."""
        step = state.reference - state.previous_reference
        farthest = GUIDED_JUMP if command.frozen == Frozen.GUIDED else JUMP_DISTANCE
        return bool(np.linalg.norm(step[:3]) > farthest or abs(step[3]) > JUMP_ANGLE)

    def _step(self, target: Any) -> np.ndarray:
        """Returns how far a target moves in a period, shape (6,): x, y, z, yaw [m, rad] and no change of slope."""
        return self.period * np.array([target.vx, target.vy, target.vz, target.yaw_rate, *LEVEL])

    def _begin(self, state: ToolMotionState, time: float, command: Any, target: Any, q6: float) -> ToolMotionState:
        """Solves for Drive, and for its rate, from the last two poses of the tool and of the reference."""
        keep = _flip_locked(command) and self.symmetric
        branch = state.branch if keep else self._best_branch(state, q6)
        # Jaws that are flipping do the rest as a part of this motion; otherwise they would turn twice as fast.
        state = replace(state, branch=branch, previous_branch=branch, flip_start=-np.inf)
        if not self.moving or state.frame == MotionFrame.GOAL:
            state = replace(state, previous_reference=state.reference)
        elif self._jumped(state, command):  # its last step does not tell how it moves
            state = replace(state, previous_reference=state.reference - self._step(target))
        before_last = 2 * state.previous_reference - state.reference
        drive = self._solve(state.tool, state.previous_reference, command.height, branch)
        earlier = self._solve(state.previous_tool, before_last, command.height, branch)
        rate = Drive(
            (drive.translation - earlier.translation) / self.period,
            (drive.turn - earlier.turn) / self.period,
            (drive.slope - earlier.slope) / self.period,
        )
        start = time - self.period  # the motion begins at the last pose of the tool
        return replace(state, motion=command.motion, start=start, drive=drive, drive_rate=rate)

    def _best_branch(self, state: ToolMotionState, q6: float) -> int:
        if self.symmetric:
            return best_branch(q6 + self._swing(state), state.tool[3], state.reference[3])
        return nearest_whole_turn(state.tool[3], state.reference[3])

    def _may_flip(self, state: ToolMotionState, time: float, command: Any) -> bool:
        """Returns whether the jaws may begin to flip."""
        return self.symmetric and not _flip_locked(command) and not self.flipping(state, time)

    def _swing(self, state: ToolMotionState) -> float:
        """Returns by how much the first joint will turn the last one until the tool is at the reference [rad]."""
        if not self.swings:
            return 0.0
        return swing_about_base(state.tool, state.reference)

    def _last_joint(self, state: ToolMotionState, q6: float) -> float:
        """Returns the angle of the last joint [rad] that decides whether the jaws must flip: now or, where a motion
        swings the hand about the base at W's origin, at its end."""
        if not self.swings:
            return q6
        return q6 + self._swing(state) + state.tool[3] - state.reference[3] - math.pi * state.branch

    def _flip(self, state: ToolMotionState, time: float, q6: float, yaw_rate: float) -> ToolMotionState:
        branch = best_branch(q6 + self._swing(state), state.tool[3], state.reference[3])
        if branch == state.branch:
            return state
        duration = flip_duration(branch - state.branch, yaw_rate, self.flip_speed)
        return replace(state, branch=branch, previous_branch=state.branch, flip_start=time, flip_duration=duration)

    def _solve(self, tool: np.ndarray, reference: np.ndarray, height: float, half_turns: float) -> Drive:
        p_WG, yaw_G = self._grasp_frame(reference, height, half_turns)
        return solve_drive(tool[:3], tool[3], p_WG, yaw_G, tool[4:], reference[4:])

    def _half_turns(self, state: ToolMotionState, time: float) -> float:
        left = 1.0 - share_done((time - state.flip_start) / state.flip_duration)
        return state.branch + (state.previous_branch - state.branch) * left

    @staticmethod
    def _grasp_frame(reference: np.ndarray, height: float, half_turns: float) -> tuple[np.ndarray, float]:
        """Returns Obj . Grasp as p_WG [m] and the direction of x_G [rad]: G is ``height`` [m] above the reference along
        the normal of its surface, with the jaws along the tangent."""
        return reference[:3] + height * surface_normal(reference[4:]), reference[3] + np.pi * half_turns


def _flip_locked(command: Any) -> bool:
    """Returns whether the jaws may not flip: during a descent they keep the direction in which it began."""
    return command.frozen != Frozen.FREE
