import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf
from scipy.stats import ncx2
from scipy.stats import rice as scipy_rice

from drake_tracker.estimation.parts.rice import (
    RATIO_LIMIT,
    RATIO_LIMITS,
    arc_length_density,
    bending_density,
    direction_density,
    exact_bending_density,
    mean_factor,
    moment_ratio,
    noise_ratio,
    recover_arc_length,
    torsion_density,
)


@pytest.mark.parametrize("x", [0.0, 0.3, 1.0, 4.0, 20.0])
def test_moments_are_those_of_the_density(x):
    sigma = 0.7
    limits = (0.0, sigma * (x + 12.0))
    moments = [quad(lambda s, n=n: s**n * arc_length_density(s, x * sigma, sigma), *limits)[0] for n in range(3)]
    assert moments[0] == pytest.approx(1.0, abs=1e-8)
    assert moments[1] == pytest.approx(sigma * mean_factor(x), rel=1e-8)  # equations 12 and 13
    assert moments[2] == pytest.approx((x * sigma) ** 2 + 2.0 * sigma**2, rel=1e-8)  # equation 14
    assert moments[1] == pytest.approx(scipy_rice.mean(x, scale=sigma), rel=1e-8)


def test_scaled_bessel_functions_survive_long_arcs():
    x = np.array([53.0, 1e3, 1e5])
    np.testing.assert_allclose(mean_factor(x), x + 0.5 / x, rtol=1e-6)
    assert np.isfinite(arc_length_density(1.0, 1.0, 1e-4))


def test_moment_ratio_falls_from_its_limit_to_one():
    x = np.geomspace(0.05, 1e3, 400)
    p = moment_ratio(x)
    assert moment_ratio(0.0) == pytest.approx(RATIO_LIMIT)
    assert np.all(np.diff(p) < 0.0)
    assert p[-1] == pytest.approx(1.0, abs=1e-6)


def test_table_inverts_the_ratio():
    x = np.geomspace(0.1, 1e3, 997)
    found = np.array([noise_ratio(p) for p in moment_ratio(x)])
    np.testing.assert_allclose(found, x, rtol=2e-4)


@pytest.mark.parametrize("s_0, sigma", [(1.0, 0.2), (1.0, 0.8), (0.02, 0.0024), (0.0, 0.5)])
def test_recovers_both_parameters_of_exact_moments(s_0, sigma):
    s_1 = sigma * mean_factor(s_0 / sigma)
    estimate = recover_arc_length(s_1, s_0**2 + 2.0 * sigma**2)
    # Near s_0 = 0 the ratio is flat, so that a rounding error is a visible arc length.
    assert estimate.s_0 == pytest.approx(s_0, rel=2e-4, abs=0.06 * sigma if s_0 == 0.0 else 0.0)
    assert estimate.sigma == pytest.approx(sigma, rel=2e-3)


def test_two_noisy_ends_return_root_two_sigma_and_the_unbiased_length():
    rng = np.random.default_rng(1000)
    chord = np.array([0.010, 0.0])
    sigma = 0.003
    s = np.linalg.norm(chord + sigma * (rng.normal(size=(200_000, 2)) - rng.normal(size=(200_000, 2))), axis=1)
    estimate = recover_arc_length(s.mean(), np.mean(s**2))
    assert s.mean() > 0.0108  # what a simple average would have taken for the arc length
    assert estimate.s_0 == pytest.approx(0.010, rel=0.01)
    assert estimate.sigma == pytest.approx(np.sqrt(2.0) * sigma, rel=0.01)


def test_ratio_without_root_is_flagged():
    assert not recover_arc_length(1.0, (RATIO_LIMIT * 1.01) ** 2).has_root
    assert recover_arc_length(1.0, (RATIO_LIMIT * 0.99) ** 2).has_root
    assert not recover_arc_length(0.0, 0.0).has_root


def test_no_noise_returns_the_length_itself():
    estimate = recover_arc_length(0.1, 0.01)
    assert estimate.s_0 == pytest.approx(0.1)
    assert estimate.sigma == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("k", [0.1, 0.4, 0.9])
def test_bending_density(k):
    phi_0 = 0.3
    limits = (phi_0 - np.pi / 2, phi_0 + np.pi / 2)
    total = quad(bending_density, *limits, args=(phi_0, k))[0]
    mean = quad(lambda phi: phi * bending_density(phi, phi_0, k), *limits)[0] / total
    assert total == pytest.approx(erf(1.0 / (np.sqrt(2.0) * k)), abs=1e-7)
    assert mean == pytest.approx(phi_0, abs=1e-7)
    assert quad(exact_bending_density, phi_0 - np.pi, phi_0 + np.pi, args=(phi_0, k))[0] == pytest.approx(1.0)


def test_exact_bending_density_is_that_of_a_noisy_direction():
    rng = np.random.default_rng(1001)
    k = 0.6
    angles = np.arctan2(k * rng.normal(size=400_000), 1.0 + k * rng.normal(size=400_000))
    counts, edges = np.histogram(angles, bins=30, range=(-np.pi, np.pi), density=True)
    centres = 0.5 * (edges[1:] + edges[:-1])
    np.testing.assert_allclose(counts, exact_bending_density(centres, 0.0, k), atol=0.015)
    # Within the half plane ahead the paper's density is close, and too low by what lies behind.
    assert np.all(bending_density(centres, 0.0, 0.2) <= exact_bending_density(centres, 0.0, 0.2) + 1e-12)


@pytest.mark.parametrize("x", [0.05, 0.3, 1.0, 4.0, 20.0, 50.0])
def test_moments_in_space_are_those_of_the_density_and_of_the_noncentral_chi_distribution(x):
    sigma = 0.7
    middle = (max(0.0, sigma * (x - 12.0)), sigma * (x + 12.0))
    moments = [quad(lambda s, n=n: s**n * arc_length_density(s, x * sigma, sigma, 3), *middle)[0] for n in range(3)]
    assert moments[0] == pytest.approx(1.0, abs=1e-8)
    assert moments[1] == pytest.approx(sigma * mean_factor(x, 3), rel=1e-8)
    assert moments[2] == pytest.approx((x * sigma) ** 2 + 3.0 * sigma**2, rel=1e-8)
    s = sigma * (x + np.array([-0.04, 0.5, 1.0]))
    distribution = [quad(arc_length_density, middle[0], end, args=(x * sigma, sigma, 3))[0] for end in s]
    np.testing.assert_allclose(distribution, ncx2.cdf((s / sigma) ** 2, 3, x**2), atol=1e-9)


def test_ratio_in_space_has_its_limits_and_the_table_inverts_it():
    x = np.geomspace(0.1, 1e3, 997)
    p = moment_ratio(x, 3)
    assert np.all(np.diff(p) < 0.0)
    assert moment_ratio(1e-3, 3) == pytest.approx(RATIO_LIMITS[3], rel=1e-6)  # at x = 0, a Maxwell distribution
    assert p[-1] - 1.0 == pytest.approx(0.5 / x[-1] ** 2, rel=1e-3)
    np.testing.assert_allclose([noise_ratio(ratio, 3) for ratio in p], x, rtol=3e-4)


@pytest.mark.parametrize("x", [1.0, 2.0, 5.0, 15.0, 50.0])
def test_arc_length_and_noise_in_space_are_recovered_where_the_planar_inversion_is_biased(x):
    rng = np.random.default_rng(1003)
    s = np.linalg.norm(np.array([x, 0.0, 0.0]) + rng.normal(size=(2_000_000, 3)), axis=1)
    moments = float(s.mean()), float(np.mean(s**2))
    estimate = recover_arc_length(*moments, dimensions=3)
    assert estimate.s_0 == pytest.approx(x, rel=0.02)
    assert estimate.sigma == pytest.approx(1.0, rel=0.02)
    if x < 4.0:
        assert recover_arc_length(*moments).s_0 > 1.03 * x


@pytest.mark.parametrize("k", [0.05, 0.4, 1.5])
def test_direction_density_is_that_of_a_noisy_direction_in_space(k):
    assert quad(direction_density, 0.0, np.pi, args=(k,), points=[k])[0] == pytest.approx(1.0)
    rng = np.random.default_rng(1004)
    chords = np.array([1.0, 0.0, 0.0]) + k * rng.normal(size=(400_000, 3))
    angles = np.arctan2(np.hypot(chords[:, 1], chords[:, 2]), chords[:, 0])
    mean = quad(lambda angle: angle * direction_density(angle, k), 0.0, np.pi, points=[k])[0]
    assert angles.mean() == pytest.approx(mean, rel=5e-3)
    below = quad(direction_density, 0.0, k, args=(k,))[0]
    assert np.mean(angles < k) == pytest.approx(below, abs=3e-3)


def test_torsion_density_is_that_of_the_plane_of_the_next_chord():
    phi_0, psi_0, k = 0.5, -0.4, 0.15
    across = np.sin(phi_0) * np.array([np.cos(psi_0), np.sin(psi_0)])
    rng = np.random.default_rng(1005)
    noisy = across + k * rng.normal(size=(400_000, 2))
    counts, edges = np.histogram(np.arctan2(noisy[:, 1], noisy[:, 0]), bins=30, range=(-np.pi, np.pi), density=True)
    np.testing.assert_allclose(counts, torsion_density(0.5 * (edges[1:] + edges[:-1]), psi_0, k, phi_0), atol=0.03)
