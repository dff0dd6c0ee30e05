"""A closed path learned from points: position as a periodic function of arc length, by Bayesian linear regression.

Each coordinate is a Fourier series over the lap. Where the curvature of a track jumps, as between a straight and a
bend, the amplitudes fall with the third power of the harmonic; that is the prior, and it keeps the many harmonics that
a sharp bend needs from following the noise where there is none.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize_scalar

from drake_tracker.core.frozen_state import read_only

SHORTEST_WAVE = 0.05
"""Finest detail of a path [m]."""
MOST_HARMONICS = 40
AMPLITUDE = 0.25
"""Prior standard deviation of harmonic k: this share of the lap's length, over k cubed."""
OFFSET = 1.0
"""Prior standard deviation of the path's mean place [m]."""
EVEN, EVEN_OVER = 0.07, 0.1
"""Labels are even when their stretch varies by less than this share, averaged over so much of the way [m]."""
REFINEMENTS = 2
"""Times a path is learned again by its own arc length."""
ARC_NODES = 400
"""Places at which the arc length of a path is reckoned."""


@dataclass(frozen=True)
class PeriodicPath:
    """A learned path (arrays are read-only).

    length: of the lap [m]. coefficients (n, 3): of x, y, z [m] for the basis 1, cos, sin, cos 2, sin 2, ...
    covariance (n, n) [m^2]: of the coefficients of each coordinate.
    """

    length: float
    coefficients: np.ndarray
    covariance: np.ndarray

    def __deepcopy__(self, memo):
        return self

    @property
    def harmonics(self):
        return len(self.coefficients) // 2

    def points(self, s):
        """Returns positions (n, 3) [m, W] at arc lengths ``s`` (n,) [m]."""
        return basis(s, self.length, self.harmonics) @ self.coefficients

    def points_and_tangents(self, s):
        """Returns positions (n, 3) [m, W] and their derivatives by arc length (n, 3) at ``s`` (n,) [m]."""
        rows = basis(s, self.length, self.harmonics)
        return rows @ self.coefficients, slope(rows, self.length) @ self.coefficients

    def variance(self, s):
        """Returns the variance [m^2] of each coordinate of the path at ``s`` (n,) [m]."""
        rows = basis(s, self.length, self.harmonics)
        return np.einsum("ij,jk,ik->i", rows, self.covariance, rows)


def basis(s, length, harmonics):
    """Returns rows 1, cos w, sin w, cos 2w, sin 2w, ... at w = 2 pi s / length, shape (n, 2 harmonics + 1); one such
    row (2 harmonics + 1,) for a number ``s``."""
    rates = _rates(length, harmonics)
    angle = s * rates if isinstance(s, float) else np.multiply.outer(s, rates)
    rows = np.empty((*angle.shape[:-1], 2 * harmonics + 1))
    rows[..., 0] = 1.0
    np.cos(angle, out=rows[..., 1::2])
    np.sin(angle, out=rows[..., 2::2])
    return rows


def slope(rows, length):
    """Returns the derivatives by s of rows of `basis`."""
    harmonics = rows.shape[-1] // 2
    slopes = np.empty(rows.shape)
    slopes[..., 0] = 0.0
    np.multiply(_rates(length, harmonics), rows[..., 1::2], out=slopes[..., 2::2])
    np.multiply(_rates(-length, harmonics), rows[..., 2::2], out=slopes[..., 1::2])
    return slopes


@lru_cache(maxsize=64)
def _rates(length, harmonics):
    """Returns by how much the angle of each harmonic grows in a metre [rad/m], shape (harmonics,)."""
    return read_only((2.0 * math.pi / length) * np.arange(1, harmonics + 1))


def learn_path(times, s, points, length, variance):
    """Returns (`PeriodicPath`, labels (n,) [m]) of a closed path from points (n, 3) [m], in the order driven.

    ``times`` (n,) [s]; ``s`` (n,) and ``length`` [m]: how far had been driven at each point, and in a lap, as far as is
    known; ``variance``: of the noise of a point, per axis [m^2].

    A path needs labels along it. Were the object driven evenly, time would be the best label there is: it is exact, and
    a bias of the points along the path that comes again each lap is learned with the path. So time is tried first, and
    kept if the path comes out even. Else its labels are its own arc length: a filter's way is off by a percent here and
    there, but a learned path knows how long it is, and can be learned again by that.
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


def learn_even_path(times, s, points, length, lap_time, variance):
    """As `learn_path` of an object driven evenly: ``s`` [m] is the newest label, ``lap_time`` [s] about that of a lap.

    Of lap times near the one given that is taken with which points of different laps agree best: those who passed a
    place twice fix it, and the better, the more of them there are.
    """
    harmonics = harmonics_of(length)
    weights = np.diag(prior(length, harmonics) ** -2.0)
    offsets = (points - points.mean(axis=0)) / variance
    labels_of = (length / lap_time) * (times - times[-1])

    def misfit(stretch):
        rows = basis(stretch * labels_of, length, harmonics)
        moments = rows.T @ offsets
        return -float(np.sum(moments * cho_solve(cho_factor(rows.T @ rows / variance + weights), moments)))

    # Points that overlap by n are off by their noise over the root of n; a filter's guess may be off by 2 %.
    stretch = minimize_scalar(misfit, bounds=(0.98, 1.02), method="bounded", options={"xatol": 1e-5}).x
    labels = s + stretch * labels_of
    return fit_path(labels, points, length, variance), labels


def is_even(path):
    """Whether a metre of labels is about a metre of path everywhere, averaged over `EVEN_OVER`."""
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


def straighten(path, s):
    """Returns the path by its own arc length once more if it has become uneven, and ``s`` [m] so measured.

    A path that goes on learning from an object of changing speed comes to be labelled unevenly: see `learn_path`.
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


def _arc_length(path):
    """Returns labels of the path over one lap, and the true arc length [m] at each, both (ARC_NODES,)."""
    nodes = np.linspace(0.0, path.length, ARC_NODES)
    _, tangents = path.points_and_tangents(nodes)
    steps = np.hypot(tangents[:, 0], tangents[:, 1])
    return nodes, np.append(0.0, np.cumsum(0.5 * (steps[1:] + steps[:-1]) * np.diff(nodes)))


def fit_path(s, points, length, variance):
    """Returns the `PeriodicPath` of a lap of ``length`` [m] through points (n, 3) [m] at arc lengths ``s`` (n,) [m].

    ``variance``: of the noise of a point, per axis [m^2].
    """
    harmonics = harmonics_of(length)
    rows = basis(s, length, harmonics)
    information = rows.T @ rows / variance + np.diag(prior(length, harmonics) ** -2)
    covariance = np.linalg.inv(information)
    middle = points.mean(axis=0)
    coefficients = covariance @ (rows.T @ (points - middle)) / variance
    coefficients[0] += middle
    return PeriodicPath(float(length), read_only(coefficients), read_only(0.5 * (covariance + covariance.T)))


def harmonics_of(length):
    """Returns the number of harmonics for a lap of ``length`` [m]."""
    return min(max(math.ceil(length / SHORTEST_WAVE), 4), MOST_HARMONICS)


def prior(length, harmonics):
    """Returns the prior standard deviations [m] of the coefficients, shape (2 harmonics + 1,)."""
    return np.append(OFFSET, np.repeat(AMPLITUDE * length / np.arange(1, harmonics + 1) ** 3.0, 2))


def improve_path(path, row, residual, variance, keep=1.0):
    """Returns the path after one more point.

    Args:
      row: of `basis` at the point's arc length, shape (n,). residual: the point less the path there, shape (3,) [m].
      variance: of the point's noise, per axis [m^2]. keep: share of what was known that is kept, 1 for all; less lets
      the path follow one that changes slowly.
    """
    reach = path.covariance @ row
    gain = reach / (variance + row @ reach)
    covariance = path.covariance - reach[:, None] * gain
    if keep < 1.0:
        covariance *= 1.0 / keep
    coefficients = path.coefficients + gain[:, None] * residual
    return PeriodicPath(path.length, read_only(coefficients), read_only(covariance))
