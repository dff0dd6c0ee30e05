"""The closed-path estimator: it watches, notices that the path comes round, learns it, and predicts along it.

Until the path has closed it is the coordinated-turn filter and says the same. From then on it asks only where on the
learned path the object is and how fast it goes along it, so that a bend ahead no longer comes as a surprise. The
coordinated-turn filter keeps running beside it: it is asked again when the points leave the learned path.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_tracker.estimation import closure
from drake_tracker.estimation.alpha_beta_gamma import read_only
from drake_tracker.estimation.closure import History
from drake_tracker.estimation.coordinated_turn import (
    HEADING,
    SIGMA_LIMITS,
    SPEED,
    X,
    Y,
    CoordinatedTurn,
    CoordinatedTurnState,
)
from drake_tracker.estimation.periodic_path import PeriodicPath, basis, improve_path, is_even, learn_even_path, learn_path, slope, straighten
from drake_tracker.estimation.phase_filter import CRUISE, PhaseFilter, spread

LOOK_EVERY = 3
"""Points between two looks for a closure."""
SURPRISE = 9.0
"""Mean square of residuals, over what is expected of it, at which the points have left the path."""
SURPRISE_TIME = 0.15
"""Time constant of that mean [s]."""
JUMP = 0.005
"""A point farther than this [m], and six times the noise, from the filtered place has jumped."""
RECENTLY = 0.5
"""A jump so long [s] before the path is left is the reason for it."""
NOISIER = 4.0
"""The noise about the path is at most so many times the noise from point to point."""
BRAKING = 0.01
"""An object that brakes hard may run behind by so much [m], and is still on its path."""
NOISE_TIME = 4.0
"""Time constant of the noise estimate on the path [s]."""
MOST_CORRELATED = 0.95
"""Greatest correlation from one point to the next that is believed."""
RETRACED = 240
"""Points from which speed and mode at the closure are taken: the newest 4 s at 60 Hz."""
FEWEST = 60
"""Points of a lap that are enough to learn it from."""
LAPS_KEPT = 10.0
"""The path follows one that changes slowly: what is older than so many laps is forgotten."""


class Noise(NamedTuple):
    """Of the points about the path: variance per axis [m^2], and covariance from one point to the next [m^2]."""

    variance: float = 0.0
    lagged: float = 0.0
    last: float = 0.0

    @property
    def effective(self):
        """Variance [m^2] of white noise that would hurt an average as much."""
        correlation = min(max(self.lagged / self.variance, 0.0), MOST_CORRELATED)
        return self.variance * (1.0 + correlation) / (1.0 - correlation)

    def update(self, residual, weight):
        """Returns it after another residual across the path [m], which counts with ``weight``."""
        return Noise(
            max(self.variance + weight * (residual * residual - self.variance), SIGMA_LIMITS[0] ** 2),
            self.lagged + weight * (residual * self.last - self.lagged),
            residual,
        )


@dataclass(frozen=True)
class ClosedPathState:
    """What the estimator remembers.

    turn: the coordinated-turn filter's state. driven: arc length since the start [m]. history: what was driven.
    path: the learned `PeriodicPath`, None before closure. modes: state of the phase filter on it, None while the points
    are not on it. noise: of the points about the path. surprise: mean square residual over what is expected.
    jumped: when a point was last far from all that the
    coordinated turn could expect [s]. count: points so far. closed_at: arc length driven [m] at the closure. relearned: whether two laps were taken into account. shortest: laps not longer than this [m] have
    been refuted.
    """

    turn: CoordinatedTurnState
    driven: float = 0.0
    history: History = closure.EMPTY
    path: PeriodicPath | None = None
    modes: tuple | None = None
    noise: Noise = Noise()
    surprise: float = 1.0
    count: int = 0
    closed_at: float = 0.0
    shortest: float = closure.SHORTEST_LAP
    jumped: float = -math.inf
    relearned: bool = False

    def __deepcopy__(self, memo):
        return self

    @property
    def stamp(self):
        return self.turn.stamp


def _way(before, after, dt):
    """Returns the way [m] from one state of the coordinated-turn filter to the next, negative when it backed up."""
    dx, dy = after.mean[:2] - before.mean[:2]
    if before.start is not None:
        return 0.0
    if after.start is not None:  # nothing was seen for long: it will have gone on
        return max(math.hypot(dx, dy), abs(before.mean[SPEED]) * dt)
    return dx * math.cos(after.mean[HEADING]) + dy * math.sin(after.mean[HEADING])


class Place:
    """A place on a path: its ``row`` of the basis, and where it is.

    ``stretch``: metres of path for each of arc length, close to 1.
    """

    def __init__(self, path, s):
        rows = basis([s], path.length, path.harmonics)
        self.row = rows[0]
        self._at = self.row @ path.coefficients
        tangent = slope(rows, path.length)[0] @ path.coefficients
        self.stretch = math.hypot(tangent[0], tangent[1])
        self._c, self._s = tangent[0] / self.stretch, tangent[1] / self.stretch

    def offset(self, point):
        """Returns how far a point is off the place, (along, across) [m] the path."""
        dx, dy = point[0] - self._at[0], point[1] - self._at[1]
        return self._c * dx + self._s * dy, self._c * dy - self._s * dx


def _noise_about(path, s, points):
    """Returns the `Noise` of points (n, 3) [m] about a path, at arc lengths (n,) [m]."""
    at, tangents = path.points_and_tangents(s)
    away = points - at
    across = (tangents[:, 0] * away[:, 1] - tangents[:, 1] * away[:, 0]) / np.hypot(tangents[:, 0], tangents[:, 1])
    return Noise(float(np.mean(across**2)), float(np.mean(across[1:] * across[:-1])), float(across[-1]))


class ClosedPath:
    """The estimator; functional, all memory is in the `ClosedPathState` that `update` returns.

    Args:
        systematic_std: error of a point [m] that the filter cannot see, for `predict_std`.
        turn: parameters of the `CoordinatedTurn` filter within, a dict.
        phase: parameters of the `PhaseFilter`, a dict.
    """

    def __init__(self, *, systematic_std=0.0, turn=None, phase=None):
        self.systematic_std = systematic_std
        self._turn = CoordinatedTurn(**{"systematic_std": systematic_std, **(turn or {})})
        self._phase = PhaseFilter(**(phase or {}))

    def initial_state(self):
        return ClosedPathState(self._turn.initial_state())

    def ready(self, state):
        """Returns whether there is enough data for a prediction."""
        return state.modes is not None or self._turn.ready(state.turn)

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ, shape (3,) [m, W], captured at ``stamp`` [s].

        A point that is None, not finite, or not newer than the newest one returns the state as it is.
        """
        turn = self._turn.update(state.turn, stamp, p_WQ)
        if turn is state.turn:
            return state
        point = np.array(p_WQ, dtype=float)
        dt = stamp - state.stamp if math.isfinite(state.stamp) else 0.0
        driven = state.driven + _way(state.turn, turn, dt)
        history = state.history
        if turn.start is None:
            mean = turn.mean
            history = closure.remember(history, (stamp, driven, *point, mean[X], mean[Y], mean[HEADING]))
        jumped = state.jumped
        if math.hypot(point[0] - turn.mean[X], point[1] - turn.mean[Y]) > JUMP + 6.0 * state.turn.sigma:
            jumped = stamp
        state = replace(state, turn=turn, driven=driven, history=history, jumped=jumped, count=state.count + 1)
        if state.modes is not None:
            state = self._follow(state, point, dt)
        if state.modes is None and state.turn.start is None and state.count % LOOK_EVERY == 0:
            state = self._look(state)
        return state

    def _look(self, state):
        """Looks for a closure, and learns the path once it has one."""
        history = closure.look_back(state.history, state.turn.sigma, state.shortest)
        state = replace(state, history=history)
        if history.overlap < closure.OVERLAP:
            return state
        rows = history.rows[history.rows[:, closure.S] >= state.driven - history.lap - history.overlap]
        variance = state.turn.sigma**2
        points = rows[:, closure.PX : closure.PZ + 1]
        path, s = learn_path(rows[:, closure.STAMP], rows[:, closure.S], points, history.lap, variance)
        state = replace(state, surprise=1.0, closed_at=state.driven, history=History(history.rows), relearned=False)
        return self._take(state, path, s, rows, variance)

    def _take(self, state, path, s, rows, variance):
        """Goes on along a path just learned, with labels ``s`` (n,), from rows of the history."""
        newest = slice(-RETRACED, None)
        stamps, points = rows[newest, closure.STAMP], rows[newest, closure.PX : closure.PZ + 1]
        noise = _noise_about(path, s[newest], points)
        # Of noise that hangs together more is left in the path than the fit supposes.
        path = replace(path, covariance=read_only(path.covariance * (noise.effective / variance)))
        return replace(state, path=path, noise=noise, modes=self._retrace(path, stamps, s[newest], points, noise.effective))

    def _learn_again(self, state):
        """Learns the path from two laps, of which one alone hardly tells how long it is, if they were driven evenly."""
        state = replace(state, relearned=True)
        cruise = state.modes[CRUISE]
        rows = state.history.rows[state.history.rows[:, closure.S] >= state.driven - 2.0 * state.path.length]
        if cruise.probability < 0.9 or len(rows) < 2 * FEWEST or rows[-1, closure.STAMP] != state.stamp:
            return state
        s, _ = spread(state.modes)
        path, labels = learn_even_path(
            rows[:, closure.STAMP],
            s,
            rows[:, closure.PX : closure.PZ + 1],
            state.path.length,
            state.path.length / cruise.mean[1],
            state.noise.variance,
        )
        return self._take(state, path, labels, rows, state.noise.variance) if is_even(path) else state

    def _retrace(self, path, stamps, s, points, variance):
        """Returns the modes after the newest points (n, 3) [m] once more, on the path just learned from them."""
        speed = (s[-1] - s[0]) / (stamps[-1] - stamps[0])
        modes = self._phase.start(s[0], speed, 4.0 * variance, 0.1 * speed**2)
        for dt, point in zip(np.diff(stamps), points[1:], strict=True):
            modes = self._phase.propagate(modes, dt)
            expected, _ = spread(modes)
            place = Place(path, expected)
            along, _ = place.offset(point)
            modes = self._phase.correct(modes, expected + along / place.stretch, variance / place.stretch**2)
        return modes

    def _follow(self, state, point, dt):
        """Moves along the learned path, corrects phase and path by a point, or leaves the path."""
        path, variance = state.path, state.noise.effective
        modes = self._phase.propagate(state.modes, dt)
        s, phase_variance = spread(modes)
        place = Place(path, s)
        along, across = place.offset(point)
        path_variance = float(place.row @ path.covariance @ place.row)
        # Points far from a wrong path look noisy, but not from one to the next.
        expected = min(state.noise.variance, (NOISIER * state.turn.sigma) ** 2) + path_variance
        square = 0.5 * (along**2 / (expected + phase_variance + BRAKING**2) + across**2 / expected)
        surprise = state.surprise + (1.0 - math.exp(-dt / SURPRISE_TIME)) * (square - state.surprise)
        if surprise > SURPRISE:
            return self._leave(state)
        modes = self._phase.correct(modes, s + along / place.stretch, (variance + path_variance) / place.stretch**2)
        before, s = spread(state.modes)[0], spread(modes)[0]
        row = basis([s], path.length, path.harmonics)[0]
        residual = point - row @ path.coefficients
        path = improve_path(path, row, residual, variance, math.exp(-abs(s - before) / (LAPS_KEPT * path.length)))
        noise = state.noise.update(across, 1.0 - math.exp(-dt / NOISE_TIME))
        if s // path.length > before // path.length:  # a lap is done
            path, straight = straighten(path, s)
            modes = self._phase.shift(modes, straight - s)
        state = replace(state, path=path, modes=modes, noise=noise, surprise=surprise)
        if not state.relearned and state.driven - state.closed_at >= path.length:
            state = self._learn_again(state)
        return state

    def _leave(self, state):
        """The points are elsewhere: back to the coordinated turn, and a new search."""
        moved = state.stamp - state.jumped < RECENTLY
        if not moved and state.driven - state.closed_at < state.path.length:
            # It was no closure: the search goes on with what is remembered, for something longer.
            return replace(state, modes=None, path=None, shortest=state.path.length + 0.05)
        # The object is elsewhere: what the filter makes of the jump would only mislead.
        return replace(
            state, modes=None, path=None, turn=self._turn.initial_state(), history=closure.EMPTY,
            shortest=closure.SHORTEST_LAP,
        )

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] at absolute ``times`` [s], shape (n, 4); yaw is the path's direction."""
        if state.modes is None:
            return self._turn.predict(state.turn, times)
        tau = np.asarray(times, dtype=float) - state.stamp
        s = np.array([self._phase.ahead(state.modes, ahead)[0] for ahead in tau.tolist()])
        at, tangents = state.path.points_and_tangents(s)
        return np.column_stack([at, np.unwrap(np.arctan2(tangents[:, 1], tangents[:, 0]))])

    def predict_std(self, state, times):
        """Returns the expected horizontal error [m] at absolute ``times`` [s], shape (n,), 68 of 100 within it."""
        if state.modes is None:
            return self._turn.predict_std(state.turn, times)
        tau = np.maximum(np.asarray(times, dtype=float) - state.stamp, 0.0)
        s, phase_std = np.array([self._phase.ahead(state.modes, ahead) for ahead in tau.tolist()]).T
        return np.sqrt(phase_std**2 + 2.0 * state.path.variance(s) + self.systematic_std**2)
