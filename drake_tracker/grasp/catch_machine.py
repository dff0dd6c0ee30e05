"""The catch machine: runs the motor schema of `catch_schema.py` on what the arm's computer knows.

The cup goes to a *goal*, a pose that stands still until the machine gives another one: each time the foreseen crossing
has moved, a new straight line begins, as long as the way to go needs. A hand without a sense of touch cannot feel the
ball. It waits for a while after the ball was to come, and raises the cup.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.arm.crossing import Crossing
from drake_tracker.arm.transform_equation import motion_time
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import KNOT_COUNT, ServoTarget, message_size
from drake_tracker.grasp.catch_schema import (
    CATCH_PROGRAMS,
    CATCH_SAME_MOTION,
    CATCH_TRANSITIONS,
    CatchPhase,
    OperatorMode,
)
from drake_tracker.grasp.motor_schema import SchemaMachine

STOPPING_SHARE = 0.3
"""A motion that stops goes on by this share of speed times duration: less, and it would come back."""
LATER = 2.0
"""A ball due in more than this many settle times is not coming yet."""
SAME_YAW = 0.01
"""Directions no farther apart than this [rad] are the same goal."""
BY_HAND = (CatchPhase.STOPPED, CatchPhase.MANUAL)
"""Phases in which the operator decides."""


@dataclass(frozen=True)
class CatchState:
    """All that the machine remembers.

    goal: (x, y, z, yaw) [m, W, rad] of the object, read-only; duration: of the motion to it [s]; tool: the commanded
    tool (x, y, z, yaw) at the last tick; crossing: the newest `Crossing`, seen at the ``stamp`` [s]; standing: since
    when the hand waits in its place [s], inf while it does not.
    """

    goal: np.ndarray
    duration: float
    tool: np.ndarray | None = None
    phase: CatchPhase = CatchPhase.WAIT
    entered: float = 0.0
    motion: int = 0
    jaw_width: float = 0.0
    crossing: Crossing | None = None
    stamp: float = -np.inf
    standing: float = np.inf
    time: float = 0.0

    def __deepcopy__(self, memo):
        return self


@dataclass(frozen=True)
class CatchObservation:
    """What the arm's computer knows at a tick: time [s], target and status as named views, the packet of the ball's
    path as it came over the link, and the operator's mode and pose (x, y, z, yaw)."""

    time: float
    target: object
    packet: np.ndarray
    status: object
    operator: np.ndarray


class CatchMachine(SchemaMachine):
    """Arithmetic of the catch machine.

    Args:
      parameters: a scenario's `Catch`. edge: a `BoardEdge`. period: time between ticks [s].
    """

    def __init__(self, parameters, edge, period):
        super().__init__(parameters, CATCH_PROGRAMS, CATCH_TRANSITIONS, CATCH_SAME_MOTION)
        self.edge = edge
        self.period = period

    def initial_state(self):
        return CatchState(goal=read_only(np.array(self.edge.home, dtype=float)), duration=self.parameters.home_duration)

    def update(self, state, seen):
        """Returns the state after a tick with the given `CatchObservation`."""
        state = replace(state, time=seen.time)
        if seen.packet[0] != state.stamp:
            crossing = self.edge.crossing(seen.packet) or self._postponed(state, seen)
            if crossing is not None:
                state = replace(state, crossing=crossing, stamp=float(seen.packet[0]))
        state = self.advance(state, seen)
        if state.phase == CatchPhase.FOLLOW and self.parameters.follow:
            state = self._approach(state, state.crossing.place, self.parameters.rim_height, seen)
        elif state.phase == CatchPhase.MANUAL and np.all(np.isfinite(seen.operator)):
            state = self._approach(state, seen.operator[1:], 0.0, seen)
        stands = state.phase == CatchPhase.WAIT and seen.status.motion == state.motion and seen.status.fraction >= 1.0
        tool = read_only(np.array([seen.status.x, seen.status.y, seen.status.z, seen.status.yaw]))
        return replace(state, tool=tool, standing=min(state.standing, seen.time) if stands else np.inf)

    def height(self, state):
        name = CATCH_PROGRAMS[state.phase].height
        return getattr(self.parameters, name) if name else 0.0

    def duration(self, state):
        name = CATCH_PROGRAMS[state.phase].duration
        return getattr(self.parameters, name) if name else state.duration

    def object(self, state):
        """Returns the `ServoTarget` vector of the goal: an object that stands still there."""
        vector = np.zeros(message_size(ServoTarget))
        vector[0], vector[1:5], vector[-1] = state.time, state.goal, 1.0
        return vector

    def is_ready(self, state):
        """Whether the hand has been waiting in its place for a while."""
        return state.time - state.standing >= self.parameters.ready_after

    def time_left(self, state):
        """Returns the time [s] until the ball crosses the edge, inf while that is not known."""
        return state.crossing.time - state.time if state.crossing is not None else np.inf

    def enter(self, state, phase, seen):
        state = super().enter(state, phase, seen)
        if phase in BY_HAND:
            goal = self._where_it_stops(state, seen)
            return replace(state, goal=goal, duration=self.parameters.stop_duration)
        return state

    # Conditions of CATCH_TRANSITIONS, each a question about (state, seen).

    def operator_takes_over(self, state, seen):
        return seen.operator[0] == OperatorMode.TAKE_OVER

    def operator_lets_go(self, state, seen):
        return seen.operator[0] == OperatorMode.SUPERVISE

    def operator_stops(self, state, seen):
        """Whatever is neither of the two is taken for a stop."""
        return not (self.operator_takes_over(state, seen) or self.operator_lets_go(state, seen))

    def ball_comes(self, state, seen):
        return bool(seen.target.valid) and self._fresh(state) and self.time_left(state) > 0.0

    def ball_lost(self, state, seen):
        return not seen.target.valid or self.time_left(state) < -self.parameters.rest_time

    def about_to_arrive(self, state, seen):
        return self._fresh(state) and self.time_left(state) <= self.parameters.settle_time

    def arrives_elsewhere(self, state, seen):
        if not self.parameters.follow or self.time_left(state) <= 0.0:
            return False
        return np.linalg.norm((state.crossing.place - state.goal)[:3]) > self.parameters.settle_tolerance

    def arrives_later(self, state, seen):
        return self._fresh(state) and self.time_left(state) > LATER * self.parameters.settle_time

    def arrived(self, state, seen):
        return self.time_left(state) <= 0.0

    def at_rest(self, state, seen):
        return self._elapsed(state, seen) >= self.parameters.rest_time

    def raised(self, state, seen):
        return self._elapsed(state, seen) >= self.parameters.raise_duration

    # Parts of a tick.

    def _postponed(self, state, seen):
        """Returns the crossing known so far, no sooner than the end of a path on which the ball stays on the board: it
        was thrown back up. None when there is none, or when the path begins beyond the edge."""
        if state.crossing is None or not self.edge.stays_above(seen.packet):
            return None
        end = seen.packet[2] + seen.packet[3] * (KNOT_COUNT - 1)
        return state.crossing._replace(time=max(state.crossing.time, float(end)))

    def _fresh(self, state):
        """Whether the ball was seen lately: one that lies jammed is not, and what was foreseen of it is void."""
        return state.crossing is not None and state.time - state.stamp <= self.parameters.trust_time

    def _approach(self, state, pose, height, seen):
        """Returns the state with a new goal where that differs, and a motion long enough for the hand's speed."""
        step = pose - state.goal
        same = np.linalg.norm(step[:3]) <= self.parameters.follow_tolerance and abs(step[3]) <= SAME_YAW
        if same and state.entered != seen.time:
            return state
        parameters = self.parameters
        tool, v_WT = self._tool(state, seen)
        way = pose[:3] + [0.0, 0.0, height] - tool[:3]
        length = np.linalg.norm(way)
        against = np.linalg.norm(v_WT[:3] - max(v_WT[:3] @ way, 0.0) * way / max(length, 1e-9) ** 2)
        speed = parameters.manual_speed if state.phase == CatchPhase.MANUAL else parameters.hand_speed
        duration = max(motion_time(length, against, speed, parameters.hand_acceleration), parameters.shortest_motion)
        return replace(state, goal=read_only(np.array(pose, dtype=float)), motion=state.motion + 1, duration=duration)

    def _where_it_stops(self, state, seen):
        tool, rate = self._tool(state, seen)
        return read_only(tool + STOPPING_SHARE * self.parameters.stop_duration * rate)

    def _tool(self, state, seen):
        """Returns the commanded tool (x, y, z, yaw) and its rate per second."""
        tool = np.array([seen.status.x, seen.status.y, seen.status.z, seen.status.yaw])
        return tool, (tool - state.tool) / self.period if state.tool is not None else np.zeros(4)
