"""The closed-path estimator: it detects that the path repeats, learns it, and predicts along it.

Until the path has closed, the estimator predicts with a coordinated-turn filter for gentle bends. From then on, it only
estimates position and speed along the learned path, so that bends ahead are known. The coordinated-turn
filter keeps running and takes over again when the points leave the learned path.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.estimation.config import ClosedPath, CoordinatedTurn, PhaseFilterConfig
from drake_tracker.estimation.parameters import check_settings
from drake_tracker.estimation.parts import loop_closure as closure
from drake_tracker.estimation.parts.loop_closure import History
from drake_tracker.estimation.parts.path_follower import Following, PathFollower
from drake_tracker.estimation.parts.periodic_path import PeriodicPath, is_even, learn_even_path, learn_path
from drake_tracker.estimation.parts.phase_filter import PhaseFilter
from drake_tracker.estimation.parts.turn_filter import TurnFilter, TurnFilterState

SEARCH_EVERY = 3
"""Points between two searches for a closure."""
JUMP_MEMORY = 0.5
"""A jump this shortly before the points leave the path is the reason why they leave it [s]."""
LAP_MARGIN = 0.05
"""A lap is longer than a refuted one by at least this much [m]."""
CRUISING = 0.9
"""Probability of a constant speed above which two laps count as driven at constant speed."""
MIN_POINTS = 120
"""Points needed to learn the path from two laps."""
SETTLING = 0.4
"""No closure is searched for so shortly after a sudden change of speed [s]: the speed would be estimated anew."""
DIRECT = 0.6
"""An object that reappears at a straight-line distance of at least this fraction of the distance it travelled unseen
cannot have completed a lap meanwhile."""


@dataclass(frozen=True)
class ClosedPathState(FrozenState):
    """State of a `ClosedPathEstimator`.

    Attributes:
        turn: state of the coordinated-turn filter.
        distance: distance travelled since the start [m].
        history: the path travelled.
        following: the learned path and the object's position on it; None while no path is known.
        count: number of points so far.
        closed_at: distance travelled at the closure [m].
        relearned: whether the path has been learned again from two laps.
        shortest: laps up to this length have been refuted [m].
        jumped: time at which the coordinated-turn filter last met an outlier [s].
        changed: time of the last sudden change of speed [s].
    """

    turn: TurnFilterState
    distance: float = 0.0
    history: History = closure.EMPTY
    following: Following | None = None
    count: int = 0
    closed_at: float = 0.0
    relearned: bool = False
    shortest: float = closure.SHORTEST_LAP
    jumped: float = -math.inf
    changed: float = -math.inf

    @property
    def stamp(self) -> float:
        """Capture time of the newest point [s]."""
        return self.turn.stamp

    @property
    def path(self) -> PeriodicPath | None:
        """The learned path, or None."""
        return None if self.following is None else self.following.path


class ClosedPathEstimator:
    """An `Estimator` that learns a closed path.

    Args:
        settings: see `ClosedPath`.
        turn: settings of the coordinated-turn filter; None: its defaults, with the ``systematic_std`` of ``settings``.
        phase: settings of the filter of the position along the path.

    Raises:
        DrakeTrackerError: a parameter is out of range.
    """

    def __init__(
        self,
        settings: ClosedPath = ClosedPath(),
        *,
        turn: CoordinatedTurn | None = None,
        phase: PhaseFilterConfig = PhaseFilterConfig(),
    ) -> None:
        check_settings(settings, ClosedPath)
        self.settings = settings
        if turn is None:
            turn = CoordinatedTurn(systematic_std=settings.systematic_std)
        self._turn = TurnFilter(turn)
        self._follower = PathFollower(PhaseFilter(phase))

    def initial_state(self) -> ClosedPathState:
        """Returns the state before the first point."""
        return ClosedPathState(self._turn.initial_state())

    def knows_path(self, state: ClosedPathState) -> bool:
        """Returns whether the path has closed, so that bends ahead are known."""
        return state.following is not None

    def ready(self, state: ClosedPathState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return state.following is not None or self._turn.ready(state.turn)

    def update(self, state: ClosedPathState, stamp: float, p_WQ: np.ndarray | None) -> ClosedPathState:
        """Returns the state after a point, see `Estimator.update`.

        A point that is None, not finite, or not newer than the state leaves the state as it is.
        """
        turn = self._turn.update(state.turn, stamp, p_WQ)
        if turn is state.turn:
            return state
        point, stamp = np.array(p_WQ, dtype=float), turn.stamp
        dt = stamp - state.stamp if math.isfinite(state.stamp) else 0.0
        distance = state.distance + _distance_between(state.turn, turn, dt)
        history, shortest, jumped, following = state.history, state.shortest, state.jumped, state.following
        if following is None and _link_lost(state.turn, turn, dt):
            history, shortest = closure.EMPTY, closure.SHORTEST_LAP
        x, y, heading, _, _ = turn.mean.tolist()
        # Outliers are not learned. After the path has been learned from two laps the history is no longer needed.
        learns = turn.start is None and not turn.outliers
        if learns and (following is None or not state.relearned):
            history = closure.remember(history, (stamp, distance, *point, x, y, heading))
        if turn.outliers or (turn.start is not None and state.turn.outliers):
            jumped = stamp
        if following is not None:
            following = self._follower.step(following, point, dt, turn.sigma)
        left = state.path if following is None else None
        state = ClosedPathState(
            turn,
            distance,
            history,
            following,
            state.count + 1,
            state.closed_at,
            state.relearned,
            shortest,
            jumped,
            state.changed,
        )
        if left is not None:
            return self._leave(state, left.length)
        if following is not None:
            due = learns and not state.relearned and distance - state.closed_at >= following.path.length
            return self._learn_again(state, following) if due else state
        if learns and state.count % SEARCH_EVERY == 0 and stamp - state.changed > SETTLING:
            return self._search(state)
        return state

    def with_speed(self, state: ClosedPathState, gain: float, std: float) -> ClosedPathState:
        """Returns the state of an object that has just changed its speed.

        Args:
            state: the state before.
            gain: change of the speed [m/s].
            std: standard deviation of the new speed [m/s].
        """
        following = state.following
        if following is not None:
            following = self._follower.with_speed(following, gain, std)
        turn = self._turn.with_speed(state.turn, gain, std)
        return replace(state, turn=turn, following=following, changed=state.stamp)

    def _search(self, state: ClosedPathState) -> ClosedPathState:
        """Searches for a closure, and learns the path when there is one."""
        history = closure.look_back(state.history, state.turn.sigma, state.shortest)
        if history.overlap < closure.OVERLAP:
            return replace(state, history=history)
        stamps, distances, points = history.since(state.distance - history.lap - history.overlap)
        variance = state.turn.sigma**2
        path, s = learn_path(stamps, distances, points, history.lap, variance)
        if path.length < closure.SHORTEST_LAP:  # the distance was noise, back and forth
            return replace(state, history=History(history.rows))
        following = self._follower.start(path, stamps, s, points, variance)
        return replace(
            state, following=following, closed_at=state.distance, history=History(history.rows), relearned=False
        )

    def _learn_again(self, state: ClosedPathState, following: Following) -> ClosedPathState:
        """Learns the path from two laps if they were driven at constant speed; one lap hardly shows its own length."""
        state = replace(state, relearned=True)
        stamps, _, points = state.history.since(state.distance - 2.0 * following.path.length)
        if following.cruising < CRUISING or len(stamps) < MIN_POINTS or stamps[-1] != state.stamp:
            return state
        if state.changed > stamps[0]:  # the speed changed in between
            return state
        length, variance = following.path.length, following.noise.variance
        lap_time = length / following.cruise_speed
        path, s = learn_even_path(stamps, following.s, points, length, lap_time, variance)
        if not is_even(path):
            return state
        return replace(state, following=self._follower.start(path, stamps, s, points, variance))

    def _leave(self, state: ClosedPathState, length: float) -> ClosedPathState:
        """Returns the state after the points have left a path of ``length`` [m]: the search for a closure begins anew.

        If they left without a jump within a lap of the closure, it was no closure, and the search continues with the
        same history for something longer. Otherwise the object is elsewhere.
        """
        moved = state.stamp - state.jumped < JUMP_MEMORY
        if not moved and state.distance - state.closed_at < length:
            return replace(state, shortest=length + LAP_MARGIN)
        # What the coordinated-turn filter concludes from the jump would only mislead.
        return replace(state, turn=self._turn.forget(state.turn), history=closure.EMPTY, shortest=closure.SHORTEST_LAP)

    def predict(self, state: ClosedPathState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        yaw is the direction of the path, also for an object that backs up on it.
        """
        if state.following is None:
            return self._turn.predict(state.turn, times)
        return self._follower.predict(state.following, np.asarray(times, dtype=float) - state.stamp)

    def predict_std(self, state: ClosedPathState, times: ArrayLike) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it."""
        if state.following is None:
            return self._turn.predict_std(state.turn, times)
        variance = self._follower.predict_variance(state.following, np.asarray(times, dtype=float) - state.stamp)
        return np.sqrt(variance + self.settings.systematic_std**2)


def _distance_between(before: TurnFilterState, after: TurnFilterState, dt: float) -> float:
    """Returns the distance from one state of the coordinated-turn filter to the next [m], negative when it backed up.

    Args:
        before: the earlier state.
        after: the later state.
        dt: time between them [s].
    """
    if before.start is not None:
        return 0.0
    x, y, heading, _, _ = after.mean.tolist()
    x_before, y_before, _, speed, _ = before.mean.tolist()
    dx, dy = x - x_before, y - y_before
    if after.start is not None:  # the object was unseen for long; it will have kept moving
        return max(math.hypot(dx, dy), abs(speed) * dt)
    return dx * math.cos(heading) + dy * math.sin(heading)


def _link_lost(before: TurnFilterState, after: TurnFilterState, dt: float) -> bool:
    """Returns whether the path after ``before`` can no longer be linked to the path up to it.

    The link is lost if the object was out of sight for longer than a lap may take, or turned about.

    Args:
        before: the earlier state.
        after: the later state.
        dt: time between them [s].
    """
    if before.start is not None:
        return False
    x, y, heading, _, _ = after.mean.tolist()
    x_before, y_before, heading_before, speed, _ = before.mean.tolist()
    if after.start is not None:
        unseen = abs(speed) * dt
        return unseen > closure.SHORTEST_LAP and math.hypot(x - x_before, y - y_before) < DIRECT * unseen
    return math.cos(heading - heading_before) < 0.0
