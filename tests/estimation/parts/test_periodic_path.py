import numpy as np
import pytest
from drives import stadium

from drake_tracker.estimation.parts.periodic_path import (
    basis,
    basis_slope,
    fit_path,
    improve_path,
    is_even,
    learn_path,
    straighten,
)
from drake_tracker.world.train.tracks import make_track


def lap_points(track, s, sigma=0.0, seed=0):
    x, y, _ = track.pose(s)
    noise = sigma * np.random.default_rng(seed).standard_normal((len(s), 3))
    return np.column_stack([x, y, np.full(len(s), 0.485)]) + noise


def test_slope_is_the_derivative_of_the_basis():
    s, step = np.linspace(0.0, 2.0, 7), 1e-6
    numeric = (basis(s + step, 1.3, 5) - basis(s - step, 1.3, 5)) / (2 * step)
    np.testing.assert_allclose(basis_slope(basis(s, 1.3, 5), 1.3), numeric, atol=1e-7)


@pytest.mark.parametrize("kind", ["stadium", "oval", "figure_eight"])
def test_a_lap_of_noisy_points_gives_the_path(kind):
    track = stadium() if kind == "stadium" else make_track(kind)
    s = np.linspace(0.0, track.length, 600, endpoint=False)
    path = fit_path(s, lap_points(track, s, 0.001), track.length, 0.001**2)
    exact = lap_points(track, s)
    error = np.linalg.norm((path.points(s) - exact)[:, :2], axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.0006
    _, tangents = path.points_and_tangents(s)
    heading = np.arctan2(tangents[:, 1], tangents[:, 0])
    assert np.degrees(np.std(np.angle(np.exp(1j * (heading - track.pose(s)[2]))))) < 1.5
    # Its estimate of its own error is right within a third.
    assert np.sqrt(np.mean(path.variance_of(basis(s, path.length, path.harmonics)))) == pytest.approx(
        np.sqrt(np.mean(error**2) / 2), rel=0.35
    )


def test_points_one_by_one_are_points_all_at_once():
    track = stadium()
    s = np.linspace(0.0, 1.2 * track.length, 300)
    points = lap_points(track, s, 0.001)
    path = fit_path(s[:250], points[:250], track.length, 1e-6)
    for arc, point in zip(s[250:], points[250:], strict=True):
        row = basis([arc], path.length, path.harmonics)[0]
        path = improve_path(path, row, point - row @ path.coefficients, 1e-6)
    whole = fit_path(s, points, track.length, 1e-6)
    np.testing.assert_allclose(path.points(s), whole.points(s), atol=1e-5)
    np.testing.assert_allclose(path.covariance, whole.covariance, atol=1e-9)


def test_an_even_drive_is_labelled_by_time():
    track = stadium()
    times = np.linspace(0.0, 1.05 * track.length / 0.15, 700)
    wrong = 0.15 * times + 0.01 * np.sin(9.0 * times)  # a filter's estimate of the distance
    path, labels = learn_path(times, wrong, lap_points(track, 0.15 * times, 0.0005), track.length, 0.0005**2)
    np.testing.assert_allclose(np.diff(labels), np.diff(labels)[0], rtol=1e-6)
    assert is_even(path)


def test_an_uneven_drive_is_labelled_by_arc_length():
    track = stadium()
    times = np.linspace(0.0, 1.05 * track.length / 0.15, 700)
    true = 0.15 * (times + 0.4 * np.sin(1.5 * times))
    guess = true + 0.01 * np.sin(4.0 * times)
    path, labels = learn_path(times, guess, lap_points(track, true, 0.0005), track.length, 0.0005**2)
    assert np.std(labels - true) < 0.2 * np.std(guess - true)
    assert path.length == pytest.approx(track.length, rel=0.01)


def test_straightening_keeps_the_position():
    track = stadium()
    s = np.linspace(0.0, track.length, 600, endpoint=False)
    uneven = s + 0.03 * np.sin(4 * np.pi * s / track.length)
    path = fit_path(uneven, lap_points(track, s), track.length, 1e-8)
    assert not is_even(path)
    straight, label = straighten(path, 2.3 * path.length)
    assert is_even(straight)
    np.testing.assert_allclose(straight.points([label])[0], path.points([2.3 * path.length])[0], atol=2e-4)
    assert straight.length == pytest.approx(track.length, rel=1e-3)
