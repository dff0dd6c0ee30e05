import numpy as np
import pytest

from drake_tracker.estimation.parts.arc import delta_power, delta_transform
from drake_tracker.estimation.parts.helix import (
    delta_transform_in_space,
    displacement,
    frenet_angles,
    length_along,
    rotated,
)
from drake_tracker.estimation.parts.helix_fit import fit_torsion, fit_turn, mean_offset, unsmoothed

RADIUS, PITCH, STEP = 0.12, 0.3, 0.01
"""Radius [m], pitch angle [rad] and arc length of a step [m] of a helix."""


def helix(n):
    """Returns the points of a helix after n steps, shape (len(n), 3), in W [m]."""
    angle = np.asarray(n, dtype=float) * STEP * np.cos(PITCH) / RADIUS
    climb = np.asarray(n, dtype=float) * STEP * np.sin(PITCH)
    return np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), climb], axis=-1)


def chord_and_turn(m=1.0):
    """Returns the chord that ends at step zero and the rotation vector of ``m`` steps."""
    return helix([0.0])[0] - helix([-m])[0], np.array([0.0, 0.0, m * STEP * np.cos(PITCH) / RADIUS])


def test_powers_of_the_transform_are_points_of_the_helix():
    chord, turn = chord_and_turn()
    phi, psi = frenet_angles(chord, turn)
    before, now = rotated(chord, turn, [-1.0, 0.0])
    x, z = now / np.linalg.norm(now), np.cross(before, now)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([x, np.cross(z, x) / np.linalg.norm(z), z / np.linalg.norm(z)])
    power = frame.copy()
    for n in range(1, 8):
        power = power @ delta_transform_in_space(np.linalg.norm(chord), phi, psi)
        expected = helix([n])[0] - helix([0.0])[0]
        np.testing.assert_allclose(power[:3, 3], expected, atol=1e-12)
        np.testing.assert_allclose(displacement(chord, turn, [n])[0], expected, atol=1e-12)


def test_fractional_and_negative_powers_lie_on_the_helix_too():
    chord, turn = chord_and_turn()
    n = np.array([-3.7, -0.5, 0.3, 2.6, 11.1])
    np.testing.assert_allclose(displacement(chord, turn, n), helix(n) - helix([0.0]), atol=1e-12)
    assert length_along(chord, turn) == pytest.approx(STEP)


def test_torsion_and_bending_are_those_of_the_curve_for_short_chords():
    chord, turn = chord_and_turn(0.01)
    phi, psi = frenet_angles(chord, turn)
    assert phi / (0.01 * STEP) == pytest.approx(np.cos(PITCH) ** 2 / RADIUS, rel=1e-5)
    assert psi / (0.01 * STEP) == pytest.approx(np.sin(PITCH) * np.cos(PITCH) / RADIUS, rel=1e-5)


def test_without_torsion_it_is_the_transform_of_the_plane():
    np.testing.assert_allclose(delta_transform_in_space(0.02, 0.3, 0.0), delta_transform(0.02, 0.3, 0.0), atol=1e-15)
    n = np.array([-2.0, 0.4, 5.0])
    plane = delta_power(0.02, 0.3, n)[0]
    space = displacement(np.array([0.02, 0.0, 0.0]), np.array([0.0, 0.0, 0.3]), n)
    np.testing.assert_allclose(space, np.stack([plane.real, plane.imag, 0.0 * n], axis=-1), atol=1e-12)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.02, -0.1, 0.3)])
def test_means_of_chords_and_points_are_undone(turn):
    turn, weights, ages = np.array(turn), np.array([0.1, 0.2, 0.4, 0.3]), np.array([-1.2, 0.0, 0.5, 2.0])
    chord = np.array([0.02, 0.01, 0.005])
    mean = weights @ rotated(chord, turn, -ages)
    np.testing.assert_allclose(unsmoothed(mean, turn, weights, ages), chord, atol=1e-12)
    points = displacement(chord, turn, -ages)
    np.testing.assert_allclose(mean_offset(chord, turn, weights, ages), weights @ points, atol=1e-15)


def test_fit_is_exact_without_noise_and_unbiased_with_it():
    m, order = 4, 40
    n = -np.arange(order + 2 * m + 1.0) / 2.0  # two points per step
    weights = np.full(order + 1, 1.0 / (order + 1))
    expected, rng, sigma = chord_and_turn(0.5 * m)[1], np.random.default_rng(1006), 0.0001
    length, torsion = 0.5 * m * STEP, 0.5 * m * STEP * np.sin(PITCH) * np.cos(PITCH) / RADIUS
    exact = helix(n)
    assert fit_torsion(exact, m, weights, 0.0, length) == pytest.approx(torsion, rel=1e-4)
    np.testing.assert_allclose(fit_turn(exact[:-m] - exact[m:], m, weights, 0.0, torsion), expected, atol=1e-5)
    torsions, turns = [], []
    for _ in range(400):
        points = exact + sigma * rng.normal(size=exact.shape)
        torsions.append(fit_torsion(points, m, weights, sigma**2, length))
        turns.append(fit_turn(points[:-m] - points[m:], m, weights, sigma**2, torsion))
    assert np.mean(torsions) == pytest.approx(torsion, abs=3.0 * np.std(torsions) / 20.0 + 0.02 * torsion)
    np.testing.assert_allclose(np.mean(turns, axis=0), expected, atol=3.0 * np.std(turns, axis=0).max() / 20.0)


def test_torsion_of_a_straight_path_is_small_however_noisy_the_points_are():
    rng, weights = np.random.default_rng(1007), np.full(81, 1.0 / 81.0)
    for sigma in (1e-9, 1e-4, 1e-2):
        points = np.outer(-np.arange(102.0), [0.002, 0.001, 0.0005]) + sigma * rng.normal(size=(102, 3))
        torsion = fit_torsion(points, 10, weights, sigma**2, 0.023)
        assert abs(torsion) < 0.023  # 1 / m
