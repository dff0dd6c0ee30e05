"""The catch machine: runs the motor schema of `catch_schema.py` on the inputs of the arm's computer.

The cup moves to a *goal*, a pose that stands still until the machine gives another one. Each time the predicted
crossing has moved, a new straight-line motion begins, which lasts as long as its distance needs. The hand has no sense
of touch and cannot feel the ball: it waits for a while after the predicted arrival, and then raises the cup.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Prediction, prediction_end
from drake_tracker.grasp.ball.board_exit import BoardEdge, BoardExit
from drake_tracker.grasp.ball.catch_schema import CATCH_PROGRAMS, CATCH_SAME_MOTION, CATCH_TRANSITIONS, CatchPhase
from drake_tracker.grasp.config import CatchConfig
from drake_tracker.grasp.operator_override import OperatedMachine, OperatedState, Pace, resting_target

LATER = 2.0
"""A ball that arrives in more than this many settle times is not about to arrive."""
BY_HAND = (CatchPhase.STOPPED, CatchPhase.MANUAL)
"""Phases in which the operator decides."""


@dataclass(frozen=True, kw_only=True)
class CatchState(OperatedState):
    """All that the machine remembers.

    Attributes:
        phase: the phase.
        crossing: the newest crossing of the edge, None before the first.
        stamp: stamp of the packet on which the crossing rests [s].
        standing: time since when the hand waits in its place [s], infinity while it does not.
        time: time of the last tick [s].
    """

    phase: CatchPhase = CatchPhase.WAIT
    crossing: BoardExit | None = None
    stamp: float = -np.inf
    standing: float = np.inf
    time: float = 0.0


@dataclass(frozen=True)
class CatchObservation:
    """The inputs of the arm's computer at a tick.

    Attributes:
        time: time of the tick [s].
        target: the ball's `ServoTarget`.
        packet: the `Prediction` vector of the ball's path, as it came over the link.
        status: a `ToolStatus`.
        operator: an `OperatorCommand`.
    """

    time: float
    target: Any
    packet: np.ndarray
    status: Any
    operator: Any


class CatchMachine(OperatedMachine[CatchState, CatchObservation]):
    """Arithmetic of the catch machine.

    Args:
        config: heights, durations and tolerances.
        edge: the bottom edge of the board.
        period: time between ticks [s].
    """

    config: CatchConfig

    def __init__(self, config: CatchConfig, edge: BoardEdge, period: float) -> None:
        super().__init__(config, CATCH_PROGRAMS, CATCH_TRANSITIONS, CATCH_SAME_MOTION)
        self.edge = edge
        self.period = period

    def initial_state(self) -> CatchState:
        """Returns the state of a hand that waits in its place."""
        return CatchState(goal=read_only(np.array(self.edge.home, dtype=float)), duration=self.config.home_duration)

    def update(self, state: CatchState, seen: CatchObservation) -> CatchState:
        """Returns the state after a tick."""
        state = replace(state, time=seen.time)
        stamp = Prediction(seen.packet).stamp
        if stamp != state.stamp:
            crossing = self.edge.crossing(seen.packet) or self._postponed(state, seen)
            if crossing is not None:
                state = replace(state, crossing=crossing, stamp=float(stamp))
        state = self.advance(state, seen)
        if state.phase == CatchPhase.FOLLOW and self.config.follow and state.crossing is not None:
            state = self.approach(state, state.crossing.place, self.config.rim_height, seen)
        elif state.phase == CatchPhase.MANUAL:
            state = self.obey(state, seen)
        stands = state.phase == CatchPhase.WAIT and seen.status.motion == state.motion and seen.status.fraction >= 1.0
        state = replace(state, standing=min(state.standing, seen.time) if stands else np.inf)
        return self.with_tool(state, seen)

    def height(self, state: CatchState) -> float:
        """Returns the height of the tool above the goal [m]."""
        name = CATCH_PROGRAMS[state.phase].height
        return getattr(self.config, name) if name else 0.0

    def duration(self, state: CatchState) -> float:
        """Returns the duration of the motion [s]."""
        name = CATCH_PROGRAMS[state.phase].duration
        return getattr(self.config, name) if name else state.duration

    def goal_target(self, state: CatchState) -> np.ndarray:
        """Returns the `ServoTarget` vector of the goal: a valid object at rest at the goal."""
        return resting_target(state.time, state.goal)

    def is_ready(self, state: CatchState) -> bool:
        """Returns whether the hand has been waiting in its place for a while."""
        return state.time - state.standing >= self.config.ready_after

    def time_left(self, state: CatchState) -> float:
        """Returns the time [s] until the ball crosses the edge, infinity while that is not known."""
        return state.crossing.time - state.time if state.crossing is not None else np.inf

    def enter(self, state: CatchState, phase: CatchPhase, seen: CatchObservation) -> CatchState:
        """Returns the state at the beginning of a phase."""
        state = super().enter(state, phase, seen)
        return self.stop(state, seen) if phase in BY_HAND else state

    def pace(self, state: CatchState) -> Pace:
        """Returns how the hand moves to its goal: more slowly under the operator's control."""
        config = self.config
        speed = config.manual_speed if state.phase == CatchPhase.MANUAL else config.hand_speed
        return Pace(speed, config.hand_acceleration, config.shortest_motion, config.follow_tolerance)

    # Conditions of CATCH_TRANSITIONS: questions about the state and what is seen.

    def ball_comes(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether a ball is on its way to the edge."""
        return bool(seen.target.valid) and self._fresh(state) and self.time_left(state) > 0.0

    def ball_lost(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the ball is no longer seen, or should have arrived a while ago."""
        return not seen.target.valid or self.time_left(state) < -self.config.rest_time

    def about_to_arrive(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the ball arrives within the settle time."""
        return self._fresh(state) and self.time_left(state) <= self.config.settle_time

    def arrives_elsewhere(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the predicted crossing has moved too far for a cup that stands still."""
        if not self.config.follow or state.crossing is None or self.time_left(state) <= 0.0:
            return False
        return bool(np.linalg.norm((state.crossing.place - state.goal)[:3]) > self.config.settle_tolerance)

    def arrives_later(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the ball is no longer about to arrive."""
        return self._fresh(state) and self.time_left(state) > LATER * self.config.settle_time

    def arrived(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the ball should have arrived."""
        return self.time_left(state) <= 0.0

    def at_rest(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether a ball in the cup has come to rest."""
        return self._elapsed(state, seen) >= self.config.rest_time

    def raised(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the cup is raised."""
        return self._elapsed(state, seen) >= self.config.raise_duration

    # Parts of a tick.

    def _postponed(self, state: CatchState, seen: CatchObservation) -> BoardExit | None:
        """Returns the known crossing, not before the end of a path on which the ball stays on the board: the ball was
        deflected up the slope. None when there is no crossing, or when the path begins beyond the edge."""
        if state.crossing is None or not self.edge.stays_above(seen.packet):
            return None
        return state.crossing._replace(time=max(state.crossing.time, float(prediction_end(seen.packet))))

    def _fresh(self, state: CatchState) -> bool:
        """Returns whether the ball was seen lately. A jammed ball is not, and its predicted crossing is void."""
        return state.crossing is not None and state.time - state.stamp <= self.config.trust_time
