"""The closed-path estimator: it watches, notices that the path comes round, learns it, and predicts along it.

Until the path has closed it is the coordinated-turn filter and says the same. From then on it asks only where on the
learned path the object is and how fast it goes along it, so that a bend ahead no longer comes as a surprise. The
coordinated-turn filter keeps running beside it: it is asked again when the points leave the learned path.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.estimation import closure
from drake_tracker.estimation.closure import History
from drake_tracker.estimation.coordinated_turn import CoordinatedTurn, CoordinatedTurnState
from drake_tracker.estimation.parameters import build, not_negative
from drake_tracker.estimation.path_follower import Following, PathFollower
from drake_tracker.estimation.periodic_path import is_even, learn_even_path, learn_path
from drake_tracker.estimation.phase_filter import PhaseFilter

LOOK_EVERY = 3
"""Points between two looks for a closure."""
RECENTLY = 0.5
"""A jump so long [s] before the path is left is the reason for it."""
LONGER = 0.05
"""A lap is longer than a refuted one by this [m] at least."""
SURE = 0.9
"""Probability of a constant speed with which two laps are taken as driven evenly."""
FEWEST = 120
"""Points that are enough to learn two laps from."""
DIRECT = 0.6
"""An object that comes into sight again this share of its way off, as the crow flies, has not come round meanwhile."""


@dataclass(frozen=True)
class ClosedPathState:
    """What the estimator remembers.

    turn: the coordinated-turn filter's state. driven: way since the start [m]. history: what was driven. following:
    the learned path and where on it the object is, None while none is known. count: points so far. closed_at: way
    driven [m] at the closure. relearned: whether two laps were taken into account. shortest: laps not longer than this
    [m] have been refuted. jumped: when the coordinated turn last met a wild point [s].
    """

    turn: CoordinatedTurnState
    driven: float = 0.0
    history: History = closure.EMPTY
    following: Following | None = None
    count: int = 0
    closed_at: float = 0.0
    relearned: bool = False
    shortest: float = closure.SHORTEST_LAP
    jumped: float = -math.inf

    def __deepcopy__(self, memo):
        return self

    @property
    def stamp(self):
        return self.turn.stamp

    @property
    def path(self):
        """The learned `PeriodicPath`, or None."""
        return None if self.following is None else self.following.path


class ClosedPath:
    """The estimator; functional, all memory is in the `ClosedPathState` that `update` returns.

    Args:
        systematic_std: error of a point [m] that the filter cannot see, for `predict_std`.
        turn: parameters of the `CoordinatedTurn` filter within, a dict.
        phase: parameters of the `PhaseFilter`, a dict.
    """

    def __init__(self, *, systematic_std=0.0, turn=None, phase=None):
        not_negative("closed_path", systematic_std=systematic_std)
        self.systematic_std = systematic_std
        turn = {} if turn is None else turn
        if isinstance(turn, dict):
            turn = {"systematic_std": systematic_std, **turn}
        self._turn = build(CoordinatedTurn, "closed_path's turn", turn)
        self._follower = PathFollower(build(PhaseFilter, "closed_path's phase", {} if phase is None else phase))

    def initial_state(self):
        return ClosedPathState(self._turn.initial_state())

    def ready(self, state):
        """Returns whether there is enough data for a prediction."""
        return state.following is not None or self._turn.ready(state.turn)

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ, shape (3,) [m, W], captured at ``stamp`` [s].

        A point that is None, not finite, or not newer than the newest one returns the state as it is.
        """
        turn = self._turn.update(state.turn, stamp, p_WQ)
        if turn is state.turn:
            return state
        point, stamp = np.array(p_WQ, dtype=float), turn.stamp
        dt = stamp - state.stamp if math.isfinite(state.stamp) else 0.0
        driven = state.driven + _way(state.turn, turn, dt)
        history, shortest, jumped, following = state.history, state.shortest, state.jumped, state.following
        if following is None and _lost(state.turn, turn, dt):
            history, shortest = closure.EMPTY, closure.SHORTEST_LAP
        x, y, heading, _, _ = turn.mean.tolist()
        # Of a wild point nothing is learned. Once two laps have been taken into account, what was driven is not asked
        # for again.
        learns = turn.start is None and not turn.wild
        if learns and (following is None or not state.relearned):
            history = closure.remember(history, (stamp, driven, *point, x, y, heading))
        if turn.wild or (turn.start is not None and state.turn.wild):
            jumped = stamp
        if following is not None:
            following = self._follower.step(following, point, dt, turn.sigma)
        left = following is None and state.following is not None
        length = state.path.length if left else math.nan
        state = ClosedPathState(
            turn, driven, history, following, state.count + 1, state.closed_at, state.relearned, shortest, jumped
        )
        if left:
            return self._leave(state, length)
        if following is not None:
            due = learns and not state.relearned and driven - state.closed_at >= following.path.length
            return self._learn_again(state) if due else state
        if learns and state.count % LOOK_EVERY == 0:
            return self._look(state)
        return state

    def _look(self, state):
        """Looks for a closure, and learns the path once it has one."""
        history = closure.look_back(state.history, state.turn.sigma, state.shortest)
        if history.overlap < closure.OVERLAP:
            return replace(state, history=history)
        stamps, ways, points = history.since(state.driven - history.lap - history.overlap)
        variance = state.turn.sigma**2
        path, s = learn_path(stamps, ways, points, history.lap, variance)
        if path.length < closure.SHORTEST_LAP:  # the way was one of noise, to and fro
            return replace(state, history=History(history.rows))
        following = self._follower.start(path, stamps, s, points, variance)
        return replace(
            state, following=following, closed_at=state.driven, history=History(history.rows), relearned=False
        )

    def _learn_again(self, state):
        """Learns the path from two laps, of which one alone hardly tells how long it is, if they were driven evenly."""
        state = replace(state, relearned=True)
        following = state.following
        stamps, _, points = state.history.since(state.driven - 2.0 * following.path.length)
        if following.cruising < SURE or len(stamps) < FEWEST or stamps[-1] != state.stamp:
            return state
        length, variance = following.path.length, following.noise.variance
        lap_time = length / following.cruise_speed
        path, s = learn_even_path(stamps, following.s, points, length, lap_time, variance)
        if not is_even(path):
            return state
        return replace(state, following=self._follower.start(path, stamps, s, points, variance))

    def _leave(self, state, length):
        """The points have left a path of ``length`` [m]: back to the coordinated turn, and a new search."""
        moved = state.stamp - state.jumped < RECENTLY
        if not moved and state.driven - state.closed_at < length:
            # It was no closure: the search goes on with what is remembered, for something longer.
            return replace(state, shortest=length + LONGER)
        # The object is elsewhere: what the filter makes of the jump would only mislead.
        return replace(state, turn=self._turn.forget(state.turn), history=closure.EMPTY, shortest=closure.SHORTEST_LAP)

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] at absolute ``times`` [s], shape (n, 4).

        yaw is the direction of the path, also of an object that backs up on it.
        """
        if state.following is None:
            return self._turn.predict(state.turn, times)
        return self._follower.predict(state.following, np.asarray(times, dtype=float) - state.stamp)

    def predict_std(self, state, times):
        """Returns the expected horizontal error [m] at absolute ``times`` [s], shape (n,), 68 of 100 within it."""
        if state.following is None:
            return self._turn.predict_std(state.turn, times)
        variance = self._follower.predict_variance(state.following, np.asarray(times, dtype=float) - state.stamp)
        return np.sqrt(variance + self.systematic_std**2)


def _way(before, after, dt):
    """Returns the way [m] from one state of the coordinated-turn filter to the next, negative when it backed up."""
    if before.start is not None:
        return 0.0
    x, y, heading, _, _ = after.mean.tolist()
    x_before, y_before, _, speed, _ = before.mean.tolist()
    dx, dy = x - x_before, y - y_before
    if after.start is not None:  # nothing was seen for long: it will have gone on
        return max(math.hypot(dx, dy), abs(speed) * dt)
    return dx * math.cos(heading) + dy * math.sin(heading)


def _lost(before, after, dt):
    """Whether the way from one state of the coordinated-turn filter to the next does not link what was driven before
    with what comes: it was out of sight for so long that it may have come round meanwhile, or it turned about."""
    if before.start is not None:
        return False
    x, y, heading, _, _ = after.mean.tolist()
    x_before, y_before, heading_before, speed, _ = before.mean.tolist()
    if after.start is not None:
        unseen = abs(speed) * dt
        return unseen > closure.SHORTEST_LAP and math.hypot(x - x_before, y - y_before) < DIRECT * unseen
    return math.cos(heading - heading_before) < 0.0
