"""Any estimator at any scale: the unit of length follows from the points themselves.

The estimators have constants that suit a toy train: noise of millimetres, 0.15 m/s. This wrapper measures the speed and
the noise of the first points and gives the wrapped estimator points in a unit in which the object is as fast as that
train. Its predictions are multiplied by the unit again. Points in metres, millimetres or pixels of the same motion thus
give the same result, up to the unit. When the speed turns out to be another, the newest points are filtered again in a
new unit.

A filter that estimates the noise of the points from its own residuals takes its errors in sharp bends for noise,
follows the points less, and errs more. The noise that third differences of the points show limits its estimate: they
hardly depend on the motion.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.estimator import Estimator, EstimatorState, LimitedNoise

SPEED = 0.15
"""Speed of the object in the unit of the wrapped estimator [m/s]."""
NOISE = 0.004
"""Largest noise of a point in that unit [m]; an object with more, as measured by its speed, appears slower."""
FIRST_POINTS = 8
"""Points from which the unit is found."""
STEPS = 4
"""The speed is measured over so many steps, so that noise does not count much."""
MEMORY = 2.0
"""Time for which points are kept [s]."""
MOST_POINTS = 240
"""Largest number of points that are kept."""
CHECK_EVERY = 8
"""Number of points after which the unit is checked again."""
FASTER, SLOWER = 4.0, 0.125
"""Ratios of a new unit to the old one from which on the new one is used. A short stop does not change it."""
_FROM_SECOND_DIFFERENCES = 1.0 / (math.sqrt(6.0) * 1.54)
"""Noise per axis divided by the median length of second differences: each has sqrt(6) times the noise on each of three
axes, and 1.54 is the median of the length of a vector with three normal components."""

NOISE_FACTOR = 6.0
"""Largest noise that an estimator may assume, as a multiple of that of the third differences. With a smaller factor,
the estimator follows the swaying of a walking person."""
_FROM_THIRD_DIFFERENCES = 1.0 / (math.sqrt(20.0) * 1.177)
"""Noise per axis divided by the median length of third differences of x and y: each has sqrt(20) times the noise, and
1.177 is the median of the length of a vector with two normal components."""

State = TypeVar("State", bound=EstimatorState)


@dataclass(frozen=True, eq=False)
class UnitFreeState(FrozenState):
    """State of a `UnitFreeEstimator`.

    Attributes:
        inner: state of the wrapped estimator, in its unit.
        unit: its unit of length, in that of the points; 0 until it is known.
        rows: the newest points (stamp [s], x, y, z), oldest first.
        unchecked: number of points since unit and noise were checked.
        noise: of the points per axis, in their unit.
    """

    inner: Any
    unit: float = 0.0
    rows: tuple[tuple[float, float, float, float], ...] = ()
    unchecked: int = 0
    noise: float = math.inf

    @property
    def stamp(self) -> float:
        """Capture time of the newest point [s]; -inf before the first."""
        return self.rows[-1][0] if self.rows else -math.inf


class UnitFreeEstimator(Generic[State]):
    """An `Estimator` that makes another one suit any unit of length, any size and any speed.

    Lengths are in the unit of the points.

    Args:
        estimator: the other one.
    """

    def __init__(self, estimator: Estimator[State]) -> None:
        self._estimator = estimator
        self._limited = estimator.with_noise_below if isinstance(estimator, LimitedNoise) else None

    def initial_state(self) -> UnitFreeState:
        """Returns the state before the first point."""
        return UnitFreeState(self._estimator.initial_state())

    def ready(self, state: UnitFreeState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return state.unit > 0.0 and self._estimator.ready(state.inner)

    def update(self, state: UnitFreeState, stamp: float, p_WQ: np.ndarray | None) -> UnitFreeState:
        """Returns the state after a point, see `Estimator.update`; a point that is not newer leaves it as it is."""
        if p_WQ is None or not math.isfinite(stamp) or stamp <= state.stamp:
            return state
        x, y, z = np.asarray(p_WQ, dtype=float).tolist()
        if not math.isfinite(x + y + z):
            return state
        kept = [row for row in state.rows[1 - MOST_POINTS :] if stamp - row[0] <= MEMORY]
        state = replace(state, rows=(*kept, (float(stamp), x, y, z)), unchecked=state.unchecked + 1)
        if state.unit == 0.0 or state.unchecked >= CHECK_EVERY:
            rows = np.array(state.rows)
            unit = unit_of(rows)
            state = replace(state, noise=noise_of(rows))
            if unit > 0.0 and not SLOWER * state.unit < unit < FASTER * state.unit:
                return self._in_unit(state, unit)
            state = replace(state, unchecked=0)
        if state.unit == 0.0:
            return state
        return replace(state, inner=self._updated(state.inner, stamp, np.array([x, y, z]), state.unit, state.noise))

    def _updated(self, inner: Any, stamp: float, point: np.ndarray, unit: float, noise: float) -> Any:
        """Returns the state of the wrapped estimator after a point (3,), in the unit of the points."""
        after = self._estimator.update(inner, stamp, point / unit)
        if self._limited is None or not math.isfinite(noise):
            return after
        return self._limited(after, NOISE_FACTOR * noise / unit)

    def _in_unit(self, state: UnitFreeState, unit: float) -> UnitFreeState:
        """Returns the state after the points that are kept were filtered in another unit."""
        inner = self._estimator.initial_state()
        for stamp, *point in state.rows:
            inner = self._updated(inner, stamp, np.array(point), unit, state.noise)
        return replace(state, inner=inner, unit=unit, unchecked=0)

    def predict(self, state: UnitFreeState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W and yaw [rad]."""
        rows = self._estimator.predict(state.inner, np.asarray(times, dtype=float))
        return read_only(rows * [state.unit, state.unit, state.unit, 1.0])

    def predict_std(self, state: UnitFreeState, times: ArrayLike) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,); 68 % of the errors lie within it."""
        return state.unit * self._estimator.predict_std(state.inner, np.asarray(times, dtype=float))


def unit_of(rows: np.ndarray) -> float:
    """Returns the unit of length in which an object has the speed `SPEED`, or points have at most the noise `NOISE`.

    It is 0 when there are too few points, or they are all the same.

    Args:
        rows: the newest points (stamp [s], x, y, z), oldest first, shape (n, 4).
    """
    if len(rows) < FIRST_POINTS:
        return 0.0
    way = np.linalg.norm(rows[STEPS:, 1:] - rows[:-STEPS, 1:], axis=1)
    speeds = way / (rows[STEPS:, 0] - rows[:-STEPS, 0])
    # Over two seconds the object may have stood: its speed is that of the faster half.
    speed = float(np.percentile(speeds, 75.0))
    bends = np.linalg.norm(rows[2:, 1:] - 2.0 * rows[1:-1, 1:] + rows[:-2, 1:], axis=1)
    noise = _FROM_SECOND_DIFFERENCES * float(np.median(bends))
    return max(speed / SPEED, noise / NOISE)


def noise_of(rows: np.ndarray) -> float:
    """Returns the noise of x and y of points at even times, infinite when there are too few.

    Args:
        rows: the newest points (stamp [s], x, y, z), oldest first, shape (n, 4).
    """
    if len(rows) < FIRST_POINTS:
        return math.inf
    places = rows[:, 1:3]
    thirds = places[3:] - 3.0 * places[2:-1] + 3.0 * places[1:-2] - places[:-3]
    return _FROM_THIRD_DIFFERENCES * float(np.median(np.hypot(thirds[:, 0], thirds[:, 1])))
