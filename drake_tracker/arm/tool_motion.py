"""Straight-line motions of the tool relative to the object, one after the other without a jerk."""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from drake_tracker.arm.tool_yaw import best_branch, flip_duration, must_flip, nearest_whole_turn
from drake_tracker.arm.transform_equation import Drive, apply_drive, share_done, shrink_drive, solve_drive


class MotionFrame(IntEnum):
    """The frame in which a motion is straight: values of `ArmCommand`'s ``frame`` field."""

    HOME = 0
    OBJECT = 1
    HELD = 2


JUMP_DISTANCE, JUMP_ANGLE = 0.03, 0.35
"""A reference that moves by more than this [m], [rad] in one period is approached anew instead of followed."""


@dataclass(frozen=True)
class ToolMotionState:
    """Where the commanded tool is and how it got there. Poses are (x, y, z, yaw) in W, yaw continuous."""

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

    def __deepcopy__(self, memo):
        return self


class ToolMotion:
    """Arithmetic of the hand's straight-line motions.

    Args:
      home: reference pose (x, y, z, yaw) in W about which the hand waits when there is no object.
      period: time between ticks [s].
      symmetric: whether half a turn about the approach leaves the hand as it is; if not it never turns over.
      moving: whether the object moves by itself, so that its reference's last step is its speed. A place that is
        corrected from time to time does not.
    """

    def __init__(self, home, period, symmetric=True, moving=True):
        self.home = np.asarray(home, dtype=float)
        self.period = period
        self.symmetric, self.moving = symmetric, moving

    def initial_state(self, p_WT, yaw):
        """The tool stands at p_WT [m] with its x axis at ``yaw`` [rad]."""
        tool = np.array([*p_WT, yaw])
        still = Drive(np.zeros(3), 0.0)
        return ToolMotionState(
            tool, tool, self.home, self.home, -1.0, MotionFrame.HOME, 0.0, still, still, 0, 0, -np.inf, 1.0, 1.0
        )

    def update(self, state, time, command, target, q6):
        """Returns the state after the tick at ``time`` [s].

        Args:
          command: `ArmCommand`. target: `ServoTarget`.
          q6: set-point of joint 6 [rad] that belongs to the tool pose of the last tick.
        """
        state = self._follow_reference(state, command, target)
        if command.motion != state.motion or self._jumped(state):
            state = self._begin(state, time, command, target, q6)
        elif self.symmetric and not command.frozen and not self.flipping(state, time) and must_flip(q6):
            state = self._flip(state, time, q6, target.yaw_rate)
        duration = max(command.duration, self.period)
        fraction = min((time - state.start) / duration, 1.0)
        drive = shrink_drive(state.drive, state.drive_rate, fraction, duration)
        p_WG, yaw_G = self._grasp_frame(state.reference, command.height, self._half_turns(state, time))
        p_WT, yaw_T = apply_drive(drive, p_WG, yaw_G)
        return replace(state, tool=np.array([*p_WT, yaw_T]), previous_tool=state.tool, fraction=fraction)

    def flipping(self, state, time):
        """Whether the jaws are turning over at ``time`` [s]."""
        return state.branch != state.previous_branch and time < state.flip_start + state.flip_duration

    def _follow_reference(self, state, command, target):
        frame = MotionFrame(int(command.frame))
        if frame == MotionFrame.HOME:
            reference = self.home
        elif frame == MotionFrame.OBJECT and target.valid:
            reference = np.array([target.x, target.y, target.z, target.yaw])
        else:
            reference = state.reference
        if frame != state.frame:  # a new frame has no past of its own: let it have moved as its pose moves now
            past = reference.copy()
            if frame == MotionFrame.OBJECT and target.valid:
                past -= self._step(target)
        else:
            past = state.reference
        return replace(state, reference=reference, previous_reference=past, frame=frame)

    def _jumped(self, state):
        """Whether the reference moved farther in one period than an object does: vision lost it and found it again."""
        step = state.reference - state.previous_reference
        return np.linalg.norm(step[:3]) > JUMP_DISTANCE or abs(step[3]) > JUMP_ANGLE

    def _step(self, target):
        """Returns how far a target goes in a period, (x, y, z, yaw) [m, rad]."""
        return self.period * np.array([target.vx, target.vy, target.vz, target.yaw_rate])

    def _begin(self, state, time, command, target, q6):
        """Solves for Drive, and for its rate, from the last two poses of the tool and of the reference."""
        keep = command.frozen and self.symmetric
        branch = state.branch if keep else self._best_branch(state, q6)
        # Jaws that are just turning over do the rest as a part of this motion, or they would turn twice as fast.
        state = replace(state, branch=branch, previous_branch=branch, flip_start=-np.inf)
        if not self.moving:
            state = replace(state, previous_reference=state.reference)
        elif self._jumped(state):  # its last step says nothing of how it moves
            state = replace(state, previous_reference=state.reference - self._step(target))
        before_last = 2 * state.previous_reference - state.reference
        drive = self._solve(state.tool, state.previous_reference, command.height, branch)
        earlier = self._solve(state.previous_tool, before_last, command.height, branch)
        rate = Drive((drive.translation - earlier.translation) / self.period, (drive.turn - earlier.turn) / self.period)
        start = time - self.period  # the last pose of the tool is where the motion begins
        return replace(state, motion=command.motion, start=start, drive=drive, drive_rate=rate)

    def _best_branch(self, state, q6):
        if self.symmetric:
            return best_branch(q6, state.tool[3], state.reference[3])
        return nearest_whole_turn(state.tool[3], state.reference[3])

    def _flip(self, state, time, q6, yaw_rate):
        branch = best_branch(q6, state.tool[3], state.reference[3])
        if branch == state.branch:
            return state
        duration = flip_duration(branch - state.branch, yaw_rate)
        return replace(state, branch=branch, previous_branch=state.branch, flip_start=time, flip_duration=duration)

    def _solve(self, tool, reference, height, half_turns):
        return solve_drive(tool[:3], tool[3], *self._grasp_frame(reference, height, half_turns))

    def _half_turns(self, state, time):
        left = 1.0 - share_done((time - state.flip_start) / state.flip_duration)
        return state.branch + (state.previous_branch - state.branch) * left

    @staticmethod
    def _grasp_frame(reference, height, half_turns):
        """Obj . Grasp: the grasping position stands ``height`` above the reference, its jaws along the tangent."""
        return reference[:3] + np.array([0.0, 0.0, height]), reference[3] + np.pi * half_turns
