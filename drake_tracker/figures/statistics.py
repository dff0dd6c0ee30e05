"""Statistics of noise whose samples hang together: distance from a distribution, correlation with its interval."""

from typing import NamedTuple

import numpy as np
from scipy.stats import ncx2, norm

LEVEL = 0.95
"""Confidence of the intervals."""


def rice_distribution(s, s_0, sigma):
    """Returns F(s) of equations (8) and (9) of Allen et al. 1991, for s [m] of any shape.

    (s / sigma)^2 has the noncentral chi-square distribution of two degrees of freedom.
    """
    return ncx2.cdf(np.square(np.asarray(s, dtype=float) / sigma), 2, (s_0 / sigma) ** 2)


def kolmogorov_smirnov(samples, distribution):
    """Returns the greatest distance between the empirical distribution of ``samples`` (n,) and ``distribution``.

    A distance only: the samples of a filter's input depend on each other, and the usual p-value would not hold.
    """
    samples = np.sort(samples)
    expected = distribution(samples)
    n = len(samples)
    above, below = np.arange(1, n + 1) / n - expected, expected - np.arange(n) / n
    return float(max(above.max(), below.max()))


class Correlation(NamedTuple):
    """Coefficient of correlation, its interval at `LEVEL`, number of samples, and how many independent ones they are
    worth."""

    coefficient: float
    low: float
    high: float
    samples: int
    effective_samples: float


def correlation(a, b, longest=60):
    """Returns the `Correlation` of two series (n,) by Fisher's transformation.

    Neighbouring samples overlap, so n counts for less: by Bartlett's formula the variance of the coefficient is that of
    n / sum of r_a(k) r_b(k) independent samples, r_a and r_b the autocorrelations at lag k, |k| <= ``longest``.
    """
    a, b = (np.asarray(row, dtype=float) - np.mean(row) for row in (a, b))
    n = len(a)
    lags = range(1, min(longest, n // 4) + 1)
    inflation = 1.0 + 2.0 * sum(_autocorrelation(a, k) * _autocorrelation(b, k) for k in lags)
    effective = min(n / max(inflation, 1.0 / n), float(n))
    coefficient = float(a @ b / np.sqrt((a @ a) * (b @ b)))
    half = norm.ppf(0.5 + 0.5 * LEVEL) / np.sqrt(max(effective - 3.0, 1.0))
    centre = np.arctanh(coefficient)
    return Correlation(coefficient, float(np.tanh(centre - half)), float(np.tanh(centre + half)), n, float(effective))


def _autocorrelation(row, lag):
    return float(row[lag:] @ row[:-lag] / (row @ row))


def mean_interval(rows, rng, draws=1000):
    """Returns (low, high) at `LEVEL` of the mean over the first axis of ``rows``, by a bootstrap over that axis."""
    rows = np.asarray(rows, dtype=float)
    means = np.array([rows[rng.integers(len(rows), size=len(rows))].mean(axis=0) for _ in range(draws)])
    return tuple(np.quantile(means, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0))
