"""Statistics of the figures: distances and intervals."""

import numpy as np
import pytest
from scipy.integrate import quad

from drake_tracker.estimation.parts.rice import arc_length_density
from drake_tracker.figures.statistics import correlation, kolmogorov_smirnov, mean_interval, rice_distribution


def rice_samples(s_0, sigma, n, seed):
    noise = sigma * np.random.default_rng(seed).standard_normal((n, 2))
    return np.hypot(s_0 + noise[:, 0], noise[:, 1])


@pytest.mark.parametrize("s_0, sigma", [(0.0025, 0.001), (0.0005, 0.002), (0.025, 0.001)])
def test_the_distribution_is_the_integral_of_the_density(s_0, sigma):
    for s in (0.5 * s_0 + sigma, s_0 + sigma):
        area, _ = quad(lambda x: arc_length_density(x, s_0, sigma), 0.0, s)
        assert rice_distribution(s, s_0, sigma) == pytest.approx(area, rel=1e-6)


def test_the_distance_is_small_for_the_right_distribution_only():
    n = 4000
    samples = rice_samples(0.0025, 0.001, n, seed=1)
    assert kolmogorov_smirnov(samples, lambda s: rice_distribution(s, 0.0025, 0.001)) < 1.63 / np.sqrt(n)
    assert kolmogorov_smirnov(samples, lambda s: rice_distribution(s, 0.0030, 0.001)) > 0.15


def test_the_distance_agrees_with_hand_calculation():
    assert kolmogorov_smirnov(np.array([0.3]), lambda s: s) == pytest.approx(0.7)
    assert kolmogorov_smirnov(np.array([0.25, 0.75]), lambda s: s) == pytest.approx(0.25)


def overlapping(rng, n, rho, width):
    """Two series of correlation rho, each a moving mean over ``width`` samples."""
    white = rng.standard_normal((n + width - 1, 2))
    white[:, 1] = rho * white[:, 0] + np.sqrt(1.0 - rho**2) * white[:, 1]
    return (np.convolve(row, np.ones(width) / width, "valid") for row in white.T)


@pytest.mark.parametrize("rho, width", [(0.15, 1), (0.15, 4), (-0.3, 8)])
def test_the_interval_of_a_correlation_covers_it_for_overlapping_samples(rho, width):
    rng = np.random.default_rng(3)
    found = [correlation(*overlapping(rng, 1500, rho, width)) for _ in range(200)]
    covered = np.mean([each.low <= rho <= each.high for each in found])
    assert 0.89 <= covered <= 0.99
    assert np.mean([each.coefficient for each in found]) == pytest.approx(rho, abs=0.02)
    if width > 1:
        assert np.mean([each.effective_samples for each in found]) < 0.7 * 1500


def test_the_interval_of_a_mean_covers_it():
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(100):
        low, high = mean_interval(rng.standard_normal((30, 1)), rng, draws=200)
        covered += low[0] <= 0.0 <= high[0]
    assert covered >= 85


def test_the_interval_of_one_row_is_the_row():
    low, high = mean_interval([[1.0, 2.0]], np.random.default_rng(5))
    assert list(low) == list(high) == [1.0, 2.0]
