"""An estimator of an object that turns at sharp corners: a short straight line competes with a filter of smooth paths.

A filter of smooth paths averages over a corner and needs several centimetres to recover. The line through the newest
centimetre of the path recovers sooner, but it knows nothing of bends. Both make predictions, and their errors decide
which of them counts, as in `coordinated_turn`. A filter whose predictions are right is left alone: the predictions are
then those of the wrapped estimator, bit for bit.

Nobody knows when the next corner comes, or where it leads. On a path with random corners, the mean displacement along
the present direction grows as ``P (1 - exp(-d / P))`` with the distance ``d`` travelled: ``P`` is the persistence
length of the path (Kratky and Porod 1949, for the shape of chain molecules). It is estimated from the past.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.coordinated_turn import AHEAD, EXPONENT, JUDGE_EVERY, MAX_ERROR, MEMORY
from drake_tracker.estimation.estimator import Estimator, PathLearner

LENGTH = 0.010
"""Length of the line [m]: long against the noise, short against the straights between corners."""
LONGEST, FEWEST = 0.5, 3
"""Largest age of its points [s], and their fewest number."""
GOOD = 0.015
"""Root mean square error [m] up to which the filter is left alone; chosen."""
START_ERRORS = (0.003, 0.020)
"""Root mean square errors of filter and line that are assumed at first [m]."""


@dataclass(frozen=True, eq=False)
class _Due(FrozenState):
    """Predictions that are not due yet.

    Attributes:
        time: for which they were made [s].
        filtered: place that the filter predicts, shape (2,) [m].
        start: beginning of the line, shape (2,) [m].
        ahead: displacement along the line without a corner, shape (2,) [m].
    """

    time: float
    filtered: np.ndarray
    start: np.ndarray
    ahead: np.ndarray


@dataclass(frozen=True, eq=False)
class SharpCornersState(FrozenState):
    """State of a `SharpCornersEstimator`.

    Attributes:
        wrapped: state of the filter.
        recent: the newest points, rows (stamp [s], x, y [m]), oldest first, shape (n, 3).
        due: predictions that are not due yet, oldest first.
        squares: mean squares of the errors of filter and line [m^2].
        kept: mean of the displacement along the line that became true, and of the displacement without a corner [m].
        knows_path: whether the filter has learned the path.
    """

    wrapped: Any
    recent: np.ndarray
    due: tuple[_Due, ...] = ()
    squares: tuple[float, float] = (START_ERRORS[0] ** 2, START_ERRORS[1] ** 2)
    kept: tuple[float, float] = (0.0, 0.0)
    knows_path: bool = False

    @property
    def stamp(self) -> float:
        """Capture time of the newest point [s]."""
        return float(self.wrapped.stamp)


class SharpCornersEstimator:
    """An `Estimator` in which a short straight line competes with another estimator.

    Args:
        estimator: the other one.
    """

    def __init__(self, estimator: Estimator[Any]) -> None:
        self._estimator = estimator
        self._knows_path = estimator.knows_path if isinstance(estimator, PathLearner) else None

    def initial_state(self) -> SharpCornersState:
        """Returns the state before the first point."""
        return SharpCornersState(self._estimator.initial_state(), read_only(np.empty((0, 3))))

    def ready(self, state: SharpCornersState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return self._estimator.ready(state.wrapped)

    def update(self, state: SharpCornersState, stamp: float, p_WQ: np.ndarray | None) -> SharpCornersState:
        """Returns the state after a point. A point that the other estimator does not use leaves it as it is."""
        wrapped = self._estimator.update(state.wrapped, stamp, p_WQ)
        if wrapped is state.wrapped or p_WQ is None:
            return state
        knows = self._knows_path is not None and self._knows_path(wrapped)
        if knows and not state.knows_path:  # what it predicted before says nothing
            state = replace(state, due=(), squares=SharpCornersState.squares)
        state = replace(state, knows_path=knows)
        place = np.array(p_WQ[:2], dtype=float)
        recent = np.vstack([state.recent[state.recent[:, 0] >= stamp - LONGEST], [stamp, *place]])
        state = _judged(replace(state, wrapped=wrapped, recent=read_only(recent)), stamp, place)
        if state.due and stamp + AHEAD - state.due[-1].time < JUDGE_EVERY - 1e-9:
            return state
        line = newest_line(recent)
        if line is None or not self._estimator.ready(wrapped):
            return state
        filtered = self._estimator.predict(wrapped, np.array([stamp + AHEAD]))[0, :2]
        start, velocity = line
        due = _Due(stamp + AHEAD, read_only(filtered), read_only(start), read_only(AHEAD * velocity))
        return replace(state, due=(*state.due, due))

    def predict(self, state: SharpCornersState, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad]."""
        times = np.asarray(times, dtype=float)
        path, share, line = self._estimator.predict(state.wrapped, times), line_share(state), newest_line(state.recent)
        if share == 0.0 or line is None:
            return path
        start, velocity = line
        speed = math.hypot(*velocity)
        distance = faded(speed * np.maximum(times - state.stamp, 0.0), persistence_length(state))
        apart = np.zeros((len(times), 4))
        apart[:, :2] = start + np.outer(distance, velocity / speed) - path[:, :2]
        turn = math.remainder(math.atan2(velocity[1], velocity[0]) - path[0, 3], 2.0 * math.pi)
        apart[:, 3] = turn - (path[:, 3] - path[0, 3])  # continuous along the path
        return path + share * apart

    def predict_std(self, state: SharpCornersState, times: np.ndarray) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it."""
        std, share = self._estimator.predict_std(state.wrapped, times), line_share(state)
        if share == 0.0 or newest_line(state.recent) is None:
            return std
        growing = state.squares[1] * ((np.asarray(times) - state.stamp) / AHEAD) ** 2
        return np.sqrt((1.0 - share) * std**2 + share * (growing + std[:1] ** 2))


def newest_line(recent: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Returns the line through the newest `LENGTH` of a path: its place at the newest point, shape (2,) [m], and the
    velocity along it, shape (2,) [m/s]. None without enough points, or at rest.

    Args:
        recent: rows (stamp [s], x, y [m]), oldest first, shape (n, 3).
    """
    away = np.hypot(*(recent[:, 1:] - recent[-1, 1:]).T)
    far = np.flatnonzero(away >= LENGTH)
    if len(far) == 0:
        return None
    rows = recent[min(far[-1], len(recent) - FEWEST) :] if len(recent) >= FEWEST else recent[:0]
    if len(rows) == 0:
        return None
    times = rows[:, 0] - rows[-1, 0]
    centred = times - times.mean()
    velocity = centred @ rows[:, 1:] / (centred @ centred)
    if not np.any(velocity):
        return None
    return rows[:, 1:].mean(axis=0) - times.mean() * velocity, velocity


def faded(distance: np.ndarray, persistence: float) -> np.ndarray:
    """Returns the mean displacement along the first direction of a path [m].

    Args:
        distance: travelled [m].
        persistence: persistence length of the path [m]; inf is a straight line.
    """
    return distance if math.isinf(persistence) else -persistence * np.expm1(-distance / persistence)


def persistence_length(state: SharpCornersState) -> float:
    """Returns the persistence length that explains the displacements so far [m]."""
    kept, without = state.kept
    if kept >= without or without <= 0.0:
        return math.inf
    shortest, longest = 1e-3, 1e3
    for _ in range(40):  # bisection of the logarithm
        middle = math.sqrt(shortest * longest)
        if faded(np.array(without), middle) < kept:
            shortest = middle
        else:
            longest = middle
    return longest


def line_share(state: SharpCornersState) -> float:
    """Returns the weight of the line, from 0 to 1; 0 while the filter's predictions are `GOOD`."""
    filtered, line = state.squares
    return 0.0 if filtered <= GOOD**2 else 1.0 / (1.0 + (line / filtered) ** EXPONENT)


def _judged(state: SharpCornersState, stamp: float, place: np.ndarray) -> SharpCornersState:
    """Returns the state after the predictions that are due have been judged by a point."""
    gain, due = 1.0 - math.exp(-JUDGE_EVERY / MEMORY), state.due
    (filtered, line), (kept, without), persistence = state.squares, state.kept, persistence_length(state)
    while due and due[0].time <= stamp + 1e-9:
        judged, due = due[0], due[1:]
        length = math.hypot(*judged.ahead)
        if stamp - judged.time >= JUDGE_EVERY or length == 0.0:
            continue
        direction = judged.ahead / length
        predicted = judged.start + faded(np.array(length), persistence) * direction
        errors = (math.hypot(*(place - each)) for each in (judged.filtered, predicted))
        squares = [min(error, MAX_ERROR) ** 2 for error in errors]
        filtered, line = filtered + gain * (squares[0] - filtered), line + gain * (squares[1] - line)
        kept += gain * (float((place - judged.start) @ direction) - kept)
        without += gain * (length - without)
    return replace(state, due=due, squares=(filtered, line), kept=(kept, without))
