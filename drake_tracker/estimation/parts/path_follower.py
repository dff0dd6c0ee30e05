"""Follows an object along a learned path: estimates its position, improves the path, and detects when it leaves it."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.parts.periodic_path import PeriodicPath, basis, basis_slope, improve_path, straighten
from drake_tracker.estimation.parts.phase_filter import (
    CRUISE,
    Modes,
    PhaseFilter,
    mixed_mean,
    mixed_moments,
    normalized_distance,
)
from drake_tracker.estimation.parts.turn_model import SIGMA_LIMITS

SURPRISE = 9.0
"""Mean square of the residuals, over its expected value, at which the points have left the path."""
SURPRISE_TIME = 0.15
"""Time constant of that mean [s]."""
MAX_SURPRISE = 20.0
"""Largest contribution of a point to that mean: about six points at 60 Hz must agree; a few outliers do not suffice."""
NOISE_RATIO = 4.0
"""The noise about the path is at most this many times the noise from point to point."""
BRAKING = 0.01
"""An object that brakes hard may lag behind by this much and still be on its path [m]."""
STRAYING = 0.001
"""Camera bias may vary by this much beyond the noise while the object is still on its path [m]."""
OUTLIER_STD = 6.0
"""A point this many standard deviations off along the path, for any motion of the object, is an outlier."""
JUMP_COUNT = 5
"""Number of consecutive outliers, 0.1 s at 60 Hz, after which the follower jumps to the newest point; fewer outliers
are ignored."""
NOISE_TIME = 4.0
"""Time constant of the noise estimate on the path [s]."""
MAX_CORRELATION = 0.95
"""Largest accepted correlation between the noise of consecutive points."""
RETRACED = 240
"""Number of points from which speed and mode at the closure are found: the newest 4 s at 60 Hz."""
MEMORY_LAPS = 10.0
"""Laps after which old points have lost most of their weight, so that the path follows slow changes."""


class Noise(NamedTuple):
    """Noise of the points about the path.

    Attributes:
        variance: variance per axis [m^2].
        lagged: covariance between consecutive points [m^2].
        last: newest residual across the path [m].
    """

    variance: float
    lagged: float
    last: float

    @property
    def effective(self) -> float:
        """Variance of the white noise that would degrade an average equally [m^2]."""
        correlation = min(max(self.lagged / self.variance, 0.0), MAX_CORRELATION)
        return self.variance * (1.0 + correlation) / (1.0 - correlation)

    def update(self, residual: float, weight: float) -> "Noise":
        """Returns the noise after another residual.

        Args:
            residual: distance of the point across the path [m].
            weight: weight of the residual, 0 to 1.
        """
        return Noise(
            max(self.variance + weight * (residual * residual - self.variance), SIGMA_LIMITS[0] ** 2),
            self.lagged + weight * (residual * self.last - self.lagged),
            residual,
        )


@dataclass(frozen=True)
class Following(FrozenState):
    """State of a `PathFollower`.

    Attributes:
        path: the learned path.
        modes: modes of the phase filter on it.
        noise: noise of the points about it.
        surprise: mean square residual over its expected value.
        outliers: number of newest points that were ignored as outliers.
    """

    path: PeriodicPath
    modes: Modes
    noise: Noise
    surprise: float = 1.0
    outliers: int = 0

    @property
    def cruising(self) -> float:
        """Probability that the speed is constant."""
        return self.modes[CRUISE].probability

    @property
    def s(self) -> float:
        """Arc length of the object now [m]."""
        return mixed_mean(self.modes)

    @property
    def cruise_speed(self) -> float:
        """Speed of the object, supposing that it is constant [m/s]."""
        return float(self.modes[CRUISE].mean[1])


class Place:
    """A place on a path.

    Args:
        path: the path.
        s: arc length of the place [m].

    Attributes:
        row: the basis functions there, shape (n,).
        stretch: path length per arc length label, close to 1.
    """

    def __init__(self, path: PeriodicPath, s: float) -> None:
        self.row = basis(s, path.length, path.harmonics)
        self._x, self._y, _ = (self.row @ path.coefficients).tolist()
        dx, dy, _ = (basis_slope(self.row, path.length) @ path.coefficients).tolist()
        self.stretch = math.hypot(dx, dy)
        self._c, self._s = dx / self.stretch, dy / self.stretch

    def offset(self, point: np.ndarray) -> tuple[float, float]:
        """Returns the offset of a point (3,) [m] from the place, (along, across) the path [m]."""
        x, y, _ = point.tolist()
        dx, dy = x - self._x, y - self._y
        return self._c * dx + self._s * dy, self._c * dy - self._s * dx


class PathFollower:
    """Follows an object along a `PeriodicPath`; functional, all memory is in the `Following`.

    Args:
        phase: filter of the position along the path.
    """

    def __init__(self, phase: PhaseFilter) -> None:
        self._phase = phase
        self._newest: tuple[Following, np.ndarray, _Ahead] | None = None  # `predict` and `predict_variance` share it

    def start(
        self, path: PeriodicPath, stamps: np.ndarray, s: np.ndarray, points: np.ndarray, variance: float
    ) -> Following:
        """Returns the state on a path that was just learned.

        Args:
            path: the path.
            stamps: capture times of the points it was learned from, oldest first, shape (n,) [s].
            s: their arc length labels, shape (n,) [m].
            points: the points, shape (n, 3) [m].
            variance: noise that was assumed, per axis [m^2].
        """
        stamps, s, points = stamps[-RETRACED:], s[-RETRACED:], points[-RETRACED:]
        noise = _noise_about(path, s, points)
        # Correlated noise leaves a larger error in the path than its fit assumes.
        path = replace(path, covariance=read_only(path.covariance * (noise.effective / variance)))
        return Following(path, self._retrace(path, stamps, s, points, noise.effective), noise)

    def _retrace(
        self, path: PeriodicPath, stamps: np.ndarray, s: np.ndarray, points: np.ndarray, variance: float
    ) -> Modes:
        """Returns the modes after filtering the newest points again, now on the path that was learned from them."""
        speed = (s[-1] - s[0]) / (stamps[-1] - stamps[0])
        modes = self._phase.start(s[0], speed, 4.0 * variance, 0.1 * speed**2)
        for dt, point in zip(np.diff(stamps).tolist(), points[1:], strict=True):
            modes = self._phase.propagate(modes, dt)
            expected = mixed_mean(modes)
            place = Place(path, expected)
            along, _ = place.offset(point)
            modes = self._phase.correct(modes, expected + along / place.stretch, variance / place.stretch**2)
        return modes

    def step(self, following: Following, point: np.ndarray, dt: float, sigma: float) -> Following | None:
        """Returns the state after a point, or None when the points have left the path.

        Args:
            following: the state before.
            point: the point, shape (3,), in W [m].
            dt: time since the previous point [s].
            sigma: noise from point to point, per axis [m].
        """
        path, noise = following.path, following.noise
        modes = self._phase.propagate(following.modes, dt)
        s, phase_variance = mixed_moments(modes)
        place = Place(path, s)
        along, across = place.offset(point)
        path_variance = float(place.row @ path.covariance @ place.row)
        # About a wrong path the points seem noisy, but not from one to the next.
        expected = min(noise.effective, (NOISE_RATIO * sigma) ** 2) + path_variance + STRAYING**2
        square = 0.5 * (along**2 / (expected + phase_variance + BRAKING**2) + across**2 / expected)
        counted = min(square, MAX_SURPRISE)
        surprise = following.surprise + (1.0 - math.exp(-dt / SURPRISE_TIME)) * (counted - following.surprise)
        if surprise > SURPRISE:
            return None
        # The farther a point is off beyond what noise explains, the less weight it gets.
        variance = noise.effective * max(square / SURPRISE, 1.0)
        seen, seen_variance = s + along / place.stretch, (variance + path_variance) / place.stretch**2
        if following.outliers + 1 < JUMP_COUNT and normalized_distance(modes, seen, seen_variance) > OUTLIER_STD:
            return Following(path, modes, noise, surprise, following.outliers + 1)
        modes = self._phase.correct(modes, seen, seen_variance)
        before, s = following.s, mixed_mean(modes)
        row = basis(s, path.length, path.harmonics)
        # A part of the path that was not seen tells nothing about it: the path forgets one lap at most.
        keep = math.exp(-min(abs(s - before), path.length) / (MEMORY_LAPS * path.length))
        path = improve_path(path, row, point - row @ path.coefficients, variance, keep)
        if s // path.length > before // path.length:  # a lap is complete
            path, straight = straighten(path, s)
            modes = self._phase.shift(modes, straight - s)
        if square <= SURPRISE:
            noise = noise.update(across, 1.0 - math.exp(-dt / NOISE_TIME))
        return Following(path, modes, noise, surprise)

    def with_speed(self, following: Following, gain: float, std: float) -> Following:
        """Returns the state of an object that has just changed its speed.

        Args:
            following: the state before.
            gain: change of the speed [m/s].
            std: standard deviation of the new speed [m/s].
        """
        stretch = Place(following.path, following.s).stretch
        return replace(following, modes=self._phase.with_speed(following.modes, gain / stretch, std / stretch))

    def predict(self, following: Following, taus: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        Args:
            following: the state to predict from.
            taus: times after the newest point, shape (n,) [s].
        """
        positions, tangents = following.path.points_and_tangents_of(self._ahead(following, taus).rows)
        return np.column_stack([positions, np.unwrap(np.arctan2(tangents[:, 1], tangents[:, 0]))])

    def predict_variance(self, following: Following, taus: np.ndarray) -> np.ndarray:
        """Returns the variance of the expected horizontal error, shape (n,) [m^2].

        Args:
            following: the state to predict from.
            taus: times after the newest point, shape (n,) [s].
        """
        ahead = self._ahead(following, np.maximum(taus, 0.0))
        return ahead.std**2 + 2.0 * following.path.variance_of(ahead.rows)

    def _ahead(self, following: Following, taus: np.ndarray) -> "_Ahead":
        """Returns where the object will be on the path after ``taus``, shape (n,) [s]."""
        newest = self._newest
        if newest is not None and newest[0] is following and np.array_equal(newest[1], taus):
            return newest[2]
        s, std = self._phase.predict(following.modes, taus)
        ahead = _Ahead(std, basis(s, following.path.length, following.path.harmonics))
        self._newest = (following, taus.copy(), ahead)
        return ahead


class _Ahead(NamedTuple):
    """Where an object will be on its path at n times.

    Attributes:
        std: standard deviation of its arc length, shape (n,) [m].
        rows: the basis functions of the path there, shape (n, m).
    """

    std: np.ndarray
    rows: np.ndarray


def _noise_about(path: PeriodicPath, s: np.ndarray, points: np.ndarray) -> Noise:
    """Returns the noise of points (n, 3) [m] about a path, at their arc lengths (n,) [m]."""
    positions, tangents = path.points_and_tangents(s)
    away = points - positions
    across = (tangents[:, 0] * away[:, 1] - tangents[:, 1] * away[:, 0]) / np.hypot(tangents[:, 0], tangents[:, 1])
    variance = max(float(np.mean(across**2)), SIGMA_LIMITS[0] ** 2)
    return Noise(variance, float(np.mean(across[1:] * across[:-1])), float(across[-1]))
