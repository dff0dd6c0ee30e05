"""Statistics of autocorrelated noise: distance from a distribution, correlation and mean with their intervals."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import bootstrap, kstest, ncx2, norm

LEVEL = 0.95
"""Confidence level of the intervals."""


def rice_distribution(s: ArrayLike, s_0: float, sigma: float) -> np.ndarray:
    """Returns the distribution function F(s) of equations (8) and (9) of Allen et al. 1991.

    (s / sigma)^2 has the noncentral chi-square distribution with two degrees of freedom.

    Args:
        s: measured arc lengths, of any shape [m].
        s_0: true arc length [m].
        sigma: standard deviation of the noise [m].
    """
    return ncx2.cdf(np.square(np.asarray(s, dtype=float) / sigma), 2, (s_0 / sigma) ** 2)


def kolmogorov_smirnov(samples: np.ndarray, distribution: Callable[[np.ndarray], np.ndarray]) -> float:
    """Returns the Kolmogorov-Smirnov distance between samples and a distribution, without a p-value.

    The p-value of the test would be wrong: it assumes independent samples, and those of a filter's input are not.

    Args:
        samples: shape (n,).
        distribution: the distribution function.
    """
    return float(kstest(samples, distribution).statistic)


class Correlation(NamedTuple):
    """A correlation coefficient with its interval.

    Attributes:
        coefficient: from -1 to 1.
        low: lower end of the interval at `LEVEL`.
        high: upper end of the interval at `LEVEL`.
        samples: number of samples.
        effective_samples: number of independent samples that give an interval of the same width.
    """

    coefficient: float
    low: float
    high: float
    samples: int
    effective_samples: float


def correlation(a: np.ndarray, b: np.ndarray, longest: int = 60) -> Correlation:
    """Returns the `Correlation` of two series by Fisher's transformation.

    Neighbouring samples overlap, so n samples count for fewer. By Bartlett's formula the variance of the coefficient is
    that of n / sum of r_a(k) r_b(k) independent samples, where r_a and r_b are the autocorrelations at lag k, and the
    sum is over |k| <= ``longest``.

    Args:
        a: shape (n,).
        b: shape (n,).
        longest: largest lag of the sum.
    """
    x, y = (np.asarray(row, dtype=float) - np.mean(row) for row in (a, b))
    n = len(x)
    lags = range(1, min(longest, n // 4) + 1)
    inflation = 1.0 + 2.0 * sum(_autocorrelation(x, k) * _autocorrelation(y, k) for k in lags)
    effective = min(n / max(inflation, 1.0 / n), float(n))
    coefficient = float(x @ y / np.sqrt((x @ x) * (y @ y)))
    half = norm.ppf(0.5 + 0.5 * LEVEL) / np.sqrt(max(effective - 3.0, 1.0))
    centre = np.arctanh(coefficient)
    return Correlation(coefficient, float(np.tanh(centre - half)), float(np.tanh(centre + half)), n, float(effective))


def _autocorrelation(row: np.ndarray, lag: int) -> float:
    return float(row[lag:] @ row[:-lag] / (row @ row))


def mean_interval(
    rows: Sequence[ArrayLike] | np.ndarray, rng: np.random.Generator, draws: int = 1000
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ends (low, high) of the interval at `LEVEL` of the mean over the first axis, by a bootstrap.

    Args:
        rows: shape (n, ...). With n = 1 both ends are the mean.
        rng: draws the bootstrap samples.
        draws: number of bootstrap samples.
    """
    rows = np.asarray(rows, dtype=float)
    if len(rows) < 2:
        return rows.mean(axis=0), rows.mean(axis=0)
    found = bootstrap((rows,), np.mean, n_resamples=draws, confidence_level=LEVEL, method="percentile", rng=rng)
    return found.confidence_interval.low, found.confidence_interval.high
