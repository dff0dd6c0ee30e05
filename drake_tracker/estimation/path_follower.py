"""Along a learned path: where on it the object is, how the path is improved, and when the points have left it."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.estimation.coordinated_turn import SIGMA_LIMITS
from drake_tracker.estimation.periodic_path import PeriodicPath, basis, improve_path, slope, straighten
from drake_tracker.estimation.phase_filter import CRUISE, centre, deviations, spread

SURPRISE = 9.0
"""Mean square of residuals, over what is expected of it, at which the points have left the path."""
SURPRISE_TIME = 0.15
"""Time constant of that mean [s]."""
WILDEST = 20.0
"""No point counts for more than this in that mean: so many must agree, six at 60 Hz, that a few wild ones do not."""
NOISIER = 4.0
"""The noise about the path is at most so many times the noise from point to point."""
BRAKING = 0.01
"""An object that brakes hard may run behind by so much [m], and is still on its path."""
STRAYING = 0.001
"""A bias of the cameras may come and go by so much [m], more than the noise tells; the object is still on its path."""
LEAP = 6.0
"""A point so many deviations off along the path, whatever the object does, is wild."""
MOST_WILD = 5
"""So many wild points in a row, 0.1 s at 60 Hz, and the object is there; fewer are ignored."""
NOISE_TIME = 4.0
"""Time constant of the noise estimate on the path [s]."""
MOST_CORRELATED = 0.95
"""Greatest correlation from one point to the next that is believed."""
RETRACED = 240
"""Points from which speed and mode at the closure are taken: the newest 4 s at 60 Hz."""
LAPS_KEPT = 10.0
"""The path follows one that changes slowly: what is older than so many laps is forgotten."""


class Noise(NamedTuple):
    """Of the points about the path: variance per axis [m^2], and covariance from one point to the next [m^2]."""

    variance: float
    lagged: float
    last: float

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
class Following:
    """The path, the modes of the phase filter on it, the noise of the points about it, ``surprise``: the mean square
    residual over what is expected, and how many points in a row were ``wild``."""

    path: PeriodicPath
    modes: tuple
    noise: Noise
    surprise: float = 1.0
    wild: int = 0

    def __deepcopy__(self, memo):
        return self

    @property
    def cruising(self):
        """Probability that the speed is constant."""
        return self.modes[CRUISE].probability

    @property
    def s(self):
        """Arc length now [m]."""
        return centre(self.modes)

    @property
    def cruise_speed(self):
        """The constant speed, if it is one [m/s]."""
        return float(self.modes[CRUISE].mean[1])


class Place:
    """A place on a path: its ``row`` of the basis, and where it is.

    ``stretch``: metres of path for each of arc length, close to 1.
    """

    def __init__(self, path, s):
        self.row = basis(s, path.length, path.harmonics)
        self._x, self._y, _ = (self.row @ path.coefficients).tolist()
        dx, dy, _ = (slope(self.row, path.length) @ path.coefficients).tolist()
        self.stretch = math.hypot(dx, dy)
        self._c, self._s = dx / self.stretch, dy / self.stretch

    def offset(self, point):
        """Returns how far a point (3,) [m] is off the place, (along, across) [m] the path."""
        x, y, _ = point.tolist()
        dx, dy = x - self._x, y - self._y
        return self._c * dx + self._s * dy, self._c * dy - self._s * dx


class PathFollower:
    """Follows an object along a `PeriodicPath`; functional, all memory is in the `Following`.

    ``phase``: the `PhaseFilter` of where on it the object is.
    """

    def __init__(self, phase):
        self._phase = phase

    def start(self, path, stamps, s, points, variance):
        """Returns the `Following` of a path just learned.

        Args:
          stamps (n,) [s], s (n,) [m], points (n, 3) [m]: what it was learned from, with its labels, oldest first.
          variance: of the noise that was supposed, per axis [m^2].
        """
        stamps, s, points = stamps[-RETRACED:], s[-RETRACED:], points[-RETRACED:]
        noise = _noise_about(path, s, points)
        # Of noise that hangs together more is left in the path than its fit supposes.
        path = replace(path, covariance=read_only(path.covariance * (noise.effective / variance)))
        return Following(path, self._retrace(path, stamps, s, points, noise.effective), noise)

    def _retrace(self, path, stamps, s, points, variance):
        """Returns the modes after the newest points once more, on the path that was learned from them."""
        speed = (s[-1] - s[0]) / (stamps[-1] - stamps[0])
        modes = self._phase.start(s[0], speed, 4.0 * variance, 0.1 * speed**2)
        for dt, point in zip(np.diff(stamps).tolist(), points[1:], strict=True):
            modes = self._phase.propagate(modes, dt)
            expected = centre(modes)
            place = Place(path, expected)
            along, _ = place.offset(point)
            modes = self._phase.correct(modes, expected + along / place.stretch, variance / place.stretch**2)
        return modes

    def step(self, following, point, dt, sigma):
        """Returns the `Following` after a point (3,) [m] that came ``dt`` [s] after the last, or None when the points
        have left the path. ``sigma``: noise from point to point [m].
        """
        path, noise = following.path, following.noise
        modes = self._phase.propagate(following.modes, dt)
        s, phase_variance = spread(modes)
        place = Place(path, s)
        along, across = place.offset(point)
        path_variance = float(place.row @ path.covariance @ place.row)
        # Points about a wrong path look noisy, but not from one to the next.
        expected = min(noise.effective, (NOISIER * sigma) ** 2) + path_variance + STRAYING**2
        square = 0.5 * (along**2 / (expected + phase_variance + BRAKING**2) + across**2 / expected)
        counted = min(square, WILDEST)
        surprise = following.surprise + (1.0 - math.exp(-dt / SURPRISE_TIME)) * (counted - following.surprise)
        if surprise > SURPRISE:
            return None
        # A point that is off by more than noise explains is believed less, the farther it is off.
        variance = noise.effective * max(square / SURPRISE, 1.0)
        seen, seen_variance = s + along / place.stretch, (variance + path_variance) / place.stretch**2
        if following.wild + 1 < MOST_WILD and deviations(modes, seen, seen_variance) > LEAP:
            return Following(path, modes, noise, surprise, following.wild + 1)
        modes = self._phase.correct(modes, seen, seen_variance)
        before, s = following.s, centre(modes)
        row = basis(s, path.length, path.harmonics)
        # A way not seen tells nothing of the path: it counts for a lap at most.
        keep = math.exp(-min(abs(s - before), path.length) / (LAPS_KEPT * path.length))
        path = improve_path(path, row, point - row @ path.coefficients, variance, keep)
        if s // path.length > before // path.length:  # a lap is done
            path, straight = straighten(path, s)
            modes = self._phase.shift(modes, straight - s)
        if square <= SURPRISE:
            noise = noise.update(across, 1.0 - math.exp(-dt / NOISE_TIME))
        return Following(path, modes, noise, surprise)

    def predict(self, following, taus):
        """Returns rows x, y, z [m, W], yaw [rad] expected ``taus`` (n,) [s] later, shape (n, 4)."""
        s, _ = self._phase.ahead(following.modes, taus)
        at, tangents = following.path.points_and_tangents(s)
        return np.column_stack([at, np.unwrap(np.arctan2(tangents[:, 1], tangents[:, 0]))])

    def predict_variance(self, following, taus):
        """Returns the variance [m^2] of the horizontal error expected ``taus`` (n,) [s] later, shape (n,)."""
        s, deviation = self._phase.ahead(following.modes, np.maximum(taus, 0.0))
        return deviation**2 + 2.0 * following.path.variance(s)


def _noise_about(path, s, points):
    """Returns the `Noise` of points (n, 3) [m] about a path, at arc lengths (n,) [m]."""
    at, tangents = path.points_and_tangents(s)
    away = points - at
    across = (tangents[:, 0] * away[:, 1] - tangents[:, 1] * away[:, 0]) / np.hypot(tangents[:, 0], tangents[:, 1])
    variance = max(float(np.mean(across**2)), SIGMA_LIMITS[0] ** 2)
    return Noise(variance, float(np.mean(across[1:] * across[:-1])), float(across[-1]))
