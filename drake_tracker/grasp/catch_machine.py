"""The catch machine: runs the motor schema of `catch_schema.py` on what the arm's computer knows.

The cup moves to a *goal*, a pose that stands still until the machine gives another one. Each time the predicted
crossing has moved, a new straight-line motion begins, which lasts as long as its distance needs. The hand has no sense
of touch and cannot feel the ball: it waits for a while after the predicted arrival, and then raises the cup.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_tracker.arm.transform_equation import motion_time
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Prediction, ServoTarget, message_size, prediction_end
from drake_tracker.grasp.catch_schema import (
    CATCH_PROGRAMS,
    CATCH_SAME_MOTION,
    CATCH_TRANSITIONS,
    CatchPhase,
    OperatorMode,
)
from drake_tracker.grasp.config import CatchConfig
from drake_tracker.grasp.crossing import BoardEdge, Crossing
from drake_tracker.grasp.motor_schema import SchemaMachine, SchemaState

STOPPING_SHARE = 0.3
"""A motion that stops continues by this fraction of speed times duration; with a smaller one it would move back."""
LATER = 2.0
"""A ball that arrives in more than this many settle times is not about to arrive."""
SAME_YAW = 0.01
"""Directions that differ by at most this [rad] belong to the same goal."""
BY_HAND = (CatchPhase.STOPPED, CatchPhase.MANUAL)
"""Phases in which the operator decides."""


@dataclass(frozen=True, kw_only=True)
class CatchState(SchemaState):
    """All that the machine remembers.

    Attributes:
        phase: the phase.
        goal: pose (x, y, z, yaw) in W of the goal, read-only, shape (4,) [m, rad].
        duration: duration of the motion to the goal [s].
        tool: commanded pose of the tool at the last tick, shape (4,) [m, rad], None before the first.
        crossing: the newest crossing of the edge, None before the first.
        stamp: stamp of the packet on which the crossing rests [s].
        standing: time since when the hand waits in its place [s], infinity while it does not.
        time: time of the last tick [s].
    """

    phase: CatchPhase = CatchPhase.WAIT
    goal: np.ndarray
    duration: float
    tool: np.ndarray | None = None
    crossing: Crossing | None = None
    stamp: float = -np.inf
    standing: float = np.inf
    time: float = 0.0


@dataclass(frozen=True)
class CatchObservation:
    """What the arm's computer knows at a tick.

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


class CatchMachine(SchemaMachine[CatchState, CatchObservation]):
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
            state = self._approach(state, state.crossing.place, self.config.rim_height, seen)
        elif state.phase == CatchPhase.MANUAL:
            operator = seen.operator
            pose = np.array([operator.x, operator.y, operator.z, operator.yaw])
            if np.all(np.isfinite(pose)):
                state = self._approach(state, pose, 0.0, seen)
        stands = state.phase == CatchPhase.WAIT and seen.status.motion == state.motion and seen.status.fraction >= 1.0
        tool = read_only(np.array([seen.status.x, seen.status.y, seen.status.z, seen.status.yaw]))
        return replace(state, tool=tool, standing=min(state.standing, seen.time) if stands else np.inf)

    def height(self, state: CatchState) -> float:
        """Returns the height of the tool above the goal [m]."""
        name = CATCH_PROGRAMS[state.phase].height
        return getattr(self.config, name) if name else 0.0

    def duration(self, state: CatchState) -> float:
        """Returns the duration of the motion [s]."""
        name = CATCH_PROGRAMS[state.phase].duration
        return getattr(self.config, name) if name else state.duration

    def goal_target(self, state: CatchState) -> np.ndarray:
        """Returns the `ServoTarget` vector of the goal: a valid object that stands still there."""
        vector = np.zeros(message_size(ServoTarget))
        target = ServoTarget(vector)
        target.time = state.time
        target.x, target.y, target.z, target.yaw = state.goal
        target.valid = 1.0
        return vector

    def is_ready(self, state: CatchState) -> bool:
        """Returns whether the hand has been waiting in its place for a while."""
        return state.time - state.standing >= self.config.ready_after

    def time_left(self, state: CatchState) -> float:
        """Returns the time [s] until the ball crosses the edge, infinity while that is not known."""
        return state.crossing.time - state.time if state.crossing is not None else np.inf

    def enter(self, state: CatchState, phase: CatchPhase, seen: CatchObservation) -> CatchState:
        """Returns the state at the beginning of a phase."""
        state = super().enter(state, phase, seen)
        if phase in BY_HAND:
            goal = self._where_it_stops(state, seen)
            return replace(state, goal=goal, duration=self.config.stop_duration)
        return state

    # Conditions of CATCH_TRANSITIONS: questions about the state and what is seen.

    def operator_takes_over(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the operator takes control of the hand."""
        return seen.operator.mode == OperatorMode.TAKE_OVER

    def operator_lets_go(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the operator only supervises."""
        return seen.operator.mode == OperatorMode.SUPERVISE

    def operator_stops(self, state: CatchState, seen: CatchObservation) -> bool:
        """Returns whether the operator stops the hand; any unknown mode means a stop."""
        return not (self.operator_takes_over(state, seen) or self.operator_lets_go(state, seen))

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

    def _postponed(self, state: CatchState, seen: CatchObservation) -> Crossing | None:
        """Returns the known crossing, not before the end of a path on which the ball stays on the board: the ball was
        deflected up the slope. None when there is no crossing, or when the path begins beyond the edge."""
        if state.crossing is None or not self.edge.stays_above(seen.packet):
            return None
        return state.crossing._replace(time=max(state.crossing.time, float(prediction_end(seen.packet))))

    def _fresh(self, state: CatchState) -> bool:
        """Returns whether the ball was seen lately. A jammed ball is not, and its predicted crossing is void."""
        return state.crossing is not None and state.time - state.stamp <= self.config.trust_time

    def _approach(self, state: CatchState, pose: np.ndarray, height: float, seen: CatchObservation) -> CatchState:
        """Returns the state with a new goal if it differs, and with a motion long enough for the hand's speed.

        Args:
            state: the state before.
            pose: pose (x, y, z, yaw) in W of the new goal, shape (4,) [m, rad].
            height: height of the tool above the goal [m].
            seen: what the arm's computer knows.
        """
        step = pose - state.goal
        same = np.linalg.norm(step[:3]) <= self.config.follow_tolerance and abs(step[3]) <= SAME_YAW
        if same and state.entered != seen.time:
            return state
        config = self.config
        tool, v_WT = self._tool(state, seen)
        displacement = pose[:3] + [0.0, 0.0, height] - tool[:3]
        length: Any = np.linalg.norm(displacement)
        along = max(v_WT[:3] @ displacement, 0.0) * displacement / max(length, 1e-9) ** 2
        against: Any = np.linalg.norm(v_WT[:3] - along)
        speed = config.manual_speed if state.phase == CatchPhase.MANUAL else config.hand_speed
        duration = max(motion_time(length, against, speed, config.hand_acceleration), config.shortest_motion)
        return replace(state, goal=read_only(np.array(pose, dtype=float)), motion=state.motion + 1, duration=duration)

    def _where_it_stops(self, state: CatchState, seen: CatchObservation) -> np.ndarray:
        """Returns the pose (x, y, z, yaw) at which the hand comes to rest, shape (4,) [m, rad]."""
        tool, rate = self._tool(state, seen)
        return read_only(tool + STOPPING_SHARE * self.config.stop_duration * rate)

    def _tool(self, state: CatchState, seen: CatchObservation) -> tuple[np.ndarray, np.ndarray]:
        """Returns the commanded tool (x, y, z, yaw) [m, rad] and its rate per second, each of shape (4,)."""
        tool = np.array([seen.status.x, seen.status.y, seen.status.z, seen.status.yaw])
        return tool, (tool - state.tool) / self.period if state.tool is not None else np.zeros(4)
