"""A closed path learned from points: position as a periodic function of arc length, by Bayesian linear regression.

Each coordinate is a Fourier series over the lap. Where the curvature of a track jumps, as between a straight and a
bend, the amplitudes fall with the third power of the harmonic. This prior prevents the many harmonics that a sharp bend
needs from fitting the noise elsewhere.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize_scalar

from drake_tracker.core.frozen_state import FrozenState, read_only

SHORTEST_WAVE = 0.05
"""Finest detail of a path [m]."""
MAX_HARMONICS = 40
"""Largest number of harmonics."""
AMPLITUDE = 0.25
"""Prior standard deviation of harmonic k: this fraction of the lap's length, divided by k cubed."""
OFFSET = 1.0
"""Prior standard deviation of the mean position of the path [m]."""
EVEN, EVEN_OVER = 0.07, 0.1
"""Labels are even when the standard deviation of their stretch is at most ``EVEN``, as a fraction, with the stretch
averaged over the distance ``EVEN_OVER`` [m]."""
REFINEMENTS = 2
"""Number of times a path is learned again with its own arc length as labels."""
ARC_NODES = 400
"""Places at which the arc length of a path is computed."""


@dataclass(frozen=True)
class PeriodicPath(FrozenState):
    """A learned path (arrays are read-only).

    Attributes:
        length: length of a lap [m].
        coefficients: of x, y, z for the basis 1, cos, sin, cos 2, sin 2, ..., shape (n, 3) [m].
        covariance: of the coefficients of each coordinate, shape (n, n) [m^2].
    """

    length: float
    coefficients: np.ndarray
    covariance: np.ndarray

    @property
    def harmonics(self) -> int:
        """Number of harmonics."""
        return len(self.coefficients) // 2

    def points(self, s: np.ndarray) -> np.ndarray:
        """Returns positions, shape (n, 3), in W [m], at arc lengths ``s``, shape (n,) [m]."""
        return basis(s, self.length, self.harmonics) @ self.coefficients

    def points_and_tangents(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns positions in W [m] and their derivatives by arc length, both (n, 3), at ``s``, shape (n,) [m]."""
        return self.points_and_tangents_of(basis(s, self.length, self.harmonics))

    def points_and_tangents_of(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns positions in W [m] and their derivatives by arc length, both (n, 3), at ``rows`` of the `basis`."""
        return rows @ self.coefficients, basis_slope(rows, self.length) @ self.coefficients

    def variance_of(self, rows: np.ndarray) -> np.ndarray:
        """Returns the variance of each coordinate of the path, shape (n,) [m^2], at ``rows`` of the `basis`."""
        return np.einsum("ij,ij->i", rows @ self.covariance, rows)


def basis(s: ArrayLike, length: float, harmonics: int) -> np.ndarray:
    """Returns rows 1, cos w, sin w, cos 2w, sin 2w, ... at w = 2 pi s / length, shape (n, 2 harmonics + 1).

    Args:
        s: arc lengths, shape (n,) [m]; for a float the result is one row, shape (2 harmonics + 1,).
        length: length of a lap [m].
        harmonics: number of harmonics.
    """
    rates = _rates(length, harmonics)
    angle = s * rates if isinstance(s, float) else np.multiply.outer(s, rates)
    rows = np.empty((*angle.shape[:-1], 2 * harmonics + 1))
    rows[..., 0] = 1.0
    np.cos(angle, out=rows[..., 1::2])
    np.sin(angle, out=rows[..., 2::2])
    return rows


def basis_slope(rows: np.ndarray, length: float) -> np.ndarray:
    """Returns the derivatives by s of rows of `basis`, of the same shape, for a lap of ``length`` [m]."""
    harmonics = rows.shape[-1] // 2
    slopes = np.empty(rows.shape)
    slopes[..., 0] = 0.0
    np.multiply(_rates(length, harmonics), rows[..., 1::2], out=slopes[..., 2::2])
    np.multiply(_rates(-length, harmonics), rows[..., 2::2], out=slopes[..., 1::2])
    return slopes


@lru_cache(maxsize=64)
def _rates(length: float, harmonics: int) -> np.ndarray:
    """Returns the change of each harmonic's angle per metre, shape (harmonics,) [rad/m]."""
    return read_only((2.0 * math.pi / length) * np.arange(1, harmonics + 1))


def learn_path(
    times: np.ndarray, s: np.ndarray, points: np.ndarray, length: float, variance: float
) -> tuple[PeriodicPath, np.ndarray]:
    """Learns a closed path; returns it and the labels of the points, shape (n,) [m].

    A path needs labels along it. For an object of constant speed time is the best label: it is exact, and a bias of the
    points along the path that repeats each lap is learned with the path. So time is tried first, and kept if the
    resulting path is even. Otherwise the labels are the path's own arc length: a filter's distance is off by a percent
    in places, but a learned path knows its length, and can be learned again with it.

    Args:
        times: capture times of the points, oldest first, shape (n,) [s].
        s: estimated distance travelled at each point, shape (n,) [m].
        points: the points, shape (n, 3), in W [m].
        length: estimated length of a lap [m].
        variance: noise of a point, per axis [m^2].
    """
    lap_time = times[-1] - np.interp(s[-1] - length, s, times)
    path, labels = learn_even_path(times, s[-1], points, length, lap_time, variance)
    if is_even(path):
        return path, labels
    for _ in range(REFINEMENTS):
        nodes, arc = _arc_length(fit_path(s, points, length, variance))
        laps, rest = np.divmod(s, length)
        s, length = laps * arc[-1] + np.interp(rest, nodes, arc), float(arc[-1])
    return fit_path(s, points, length, variance), s


def learn_even_path(
    times: np.ndarray, s: float, points: np.ndarray, length: float, lap_time: float, variance: float
) -> tuple[PeriodicPath, np.ndarray]:
    """As `learn_path`, for an object of constant speed.

    The function chooses the lap time, near the given lap time, for which points of different laps agree best. Points
    that passed a place twice determine the lap time; more points make it more accurate.

    Args:
        times: capture times of the points, oldest first, shape (n,) [s].
        s: label of the newest point [m].
        points: the points, shape (n, 3), in W [m].
        length: length of a lap [m].
        lap_time: estimated time of a lap [s].
        variance: noise of a point, per axis [m^2].
    """
    harmonics = harmonics_of(length)
    weights = np.diag(prior(length, harmonics) ** -2.0)
    offsets = (points - points.mean(axis=0)) / variance
    labels_of = (length / lap_time) * (times - times[-1])

    def misfit(stretch: float) -> float:
        rows = basis(stretch * labels_of, length, harmonics)
        moments = rows.T @ offsets
        return -float(np.sum(moments * cho_solve(cho_factor(rows.T @ rows / variance + weights), moments)))

    # With n overlapping points the error is the noise over the square root of n; a filter's estimate may be 2 % off.
    stretch = minimize_scalar(misfit, bounds=(0.98, 1.02), method="bounded", options={"xatol": 1e-5}).x
    labels = s + stretch * labels_of
    return fit_path(labels, points, length, variance), labels


def is_even(path: PeriodicPath) -> bool:
    """Returns whether a metre of labels is about a metre of path everywhere, averaged over `EVEN_OVER`."""
    nodes, arc = _arc_length(path)
    reach = min(EVEN_OVER / path.length, 0.5)
    ends = np.interp(
        np.arange(0.0, 1.0, 0.02) + reach,
        np.append(nodes, nodes[1:] + nodes[-1]) / nodes[-1],
        np.append(arc, arc[1:] + arc[-1]),
    )
    starts = np.interp(np.arange(0.0, 1.0, 0.02), nodes / nodes[-1], arc)
    stretch = (ends - starts) / (reach * arc[-1])
    return bool(np.std(stretch) <= EVEN)


def straighten(path: PeriodicPath, s: float) -> tuple[PeriodicPath, float]:
    """Returns the path labelled by its own arc length if it has become uneven, and ``s`` [m] in the new labels.

    The labels of a path that keeps learning from an object of changing speed become uneven: see `learn_path`.
    """
    if is_even(path):
        return path, s
    nodes, arc = _arc_length(path)
    even = np.linspace(0.0, arc[-1], ARC_NODES)[:-1]
    rows = basis(even, arc[-1], path.harmonics)
    coefficients = np.linalg.lstsq(rows, path.points(np.interp(even, arc, nodes)), rcond=None)[0]
    laps, rest = divmod(s, path.length)
    straight = PeriodicPath(float(arc[-1]), read_only(coefficients), path.covariance)
    return straight, float(laps * arc[-1] + np.interp(rest, nodes, arc))


def _arc_length(path: PeriodicPath) -> tuple[np.ndarray, np.ndarray]:
    """Returns labels of the path over one lap, and the true arc length at each [m], both (ARC_NODES,)."""
    nodes = np.linspace(0.0, path.length, ARC_NODES)
    _, tangents = path.points_and_tangents(nodes)
    steps = np.hypot(tangents[:, 0], tangents[:, 1])
    return nodes, np.append(0.0, np.cumsum(0.5 * (steps[1:] + steps[:-1]) * np.diff(nodes)))


def fit_path(s: np.ndarray, points: np.ndarray, length: float, variance: float) -> PeriodicPath:
    """Returns the path of a lap through labelled points.

    Args:
        s: arc lengths of the points, shape (n,) [m].
        points: the points, shape (n, 3), in W [m].
        length: length of a lap [m].
        variance: noise of a point, per axis [m^2].
    """
    harmonics = harmonics_of(length)
    rows = basis(s, length, harmonics)
    information = rows.T @ rows / variance + np.diag(prior(length, harmonics) ** -2)
    covariance = np.linalg.inv(information)
    middle = points.mean(axis=0)
    coefficients = covariance @ (rows.T @ (points - middle)) / variance
    coefficients[0] += middle
    return PeriodicPath(float(length), read_only(coefficients), read_only(0.5 * (covariance + covariance.T)))


def harmonics_of(length: float) -> int:
    """Returns the number of harmonics for a lap of ``length`` [m]."""
    return min(max(math.ceil(length / SHORTEST_WAVE), 4), MAX_HARMONICS)


def prior(length: float, harmonics: int) -> np.ndarray:
    """Returns the prior standard deviations of the coefficients, shape (2 harmonics + 1,) [m].

    Args:
        length: length of a lap [m].
        harmonics: number of harmonics.
    """
    return np.append(OFFSET, np.repeat(AMPLITUDE * length / np.arange(1, harmonics + 1) ** 3.0, 2))


def improve_path(
    path: PeriodicPath, row: np.ndarray, residual: np.ndarray, variance: float, keep: float = 1.0
) -> PeriodicPath:
    """Returns the path after one more point.

    Args:
        path: the path before.
        row: the `basis` at the point's arc length, shape (n,).
        residual: the point minus the path there, shape (3,) [m].
        variance: noise of the point, per axis [m^2].
        keep: fraction of the earlier knowledge that is kept; below 1 the path follows slow changes.
    """
    reach = path.covariance @ row
    gain = reach / (variance + row @ reach)
    covariance = path.covariance - reach[:, None] * gain
    if keep < 1.0:
        covariance *= 1.0 / keep
    coefficients = path.coefficients + gain[:, None] * residual
    return PeriodicPath(path.length, read_only(coefficients), read_only(covariance))
