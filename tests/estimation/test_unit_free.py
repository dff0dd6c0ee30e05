"""Estimators that find the unit of length from the points."""

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import unit_free as scaled
from drake_tracker.estimation.alpha_beta_gamma import AlphaBetaGammaEstimator
from drake_tracker.estimation.config import CoordinatedTurn
from drake_tracker.estimation.coordinated_turn import CoordinatedTurnEstimator
from drake_tracker.estimation.estimator import check_estimator
from drake_tracker.estimation.unit_free import NOISE, SPEED, UnitFreeEstimator, noise_of, unit_of
from drake_tracker.own_cameras.scale import own_estimator

RATE = 30.0


def walk(seed=0, count=80):
    """Times [s] and points [m] of somebody who walks at 1.3 m/s: the middle sways by 3 cm, with noise of 5 mm."""
    rng = np.random.default_rng(seed)
    times = np.arange(count) / RATE
    points = np.column_stack([1.3 * times - 2.0, 0.2 * times, np.full(count, 0.9)])
    points[:, 0] += 0.03 * np.sin(2.0 * np.pi * 1.8 * times)
    points[:, 2] += 0.02 * np.cos(2.0 * np.pi * 1.8 * times)
    return times, points + rng.normal(0.0, 0.005, points.shape)


def follow(estimator, times, points):
    """Filtered and predicted positions (n, 3), NaN while there is none, and the last standard deviation."""
    state = estimator.initial_state()
    filtered, predicted = np.full((2, len(times), 3), np.nan)
    for k, (time, point) in enumerate(zip(times.tolist(), points)):
        state = estimator.update(state, time, point)
        if estimator.ready(state):
            filtered[k], predicted[k] = estimator.predict(state, np.array([time, time + 0.25]))[:, :3]
    return filtered, predicted, estimator.predict_std(state, times[-1:] + 0.25)[0]


@pytest.mark.parametrize("kind", [CoordinatedTurnEstimator, AlphaBetaGammaEstimator])
def test_the_unit_of_length_does_not_matter(kind):
    times, points = walk()
    metres, ahead, std = follow(UnitFreeEstimator(kind()), times, points)
    for unit in (1000.0, 1e-3, 250.0):
        filtered, predicted, std_there = follow(UnitFreeEstimator(kind()), times, unit * points)
        np.testing.assert_allclose(filtered, unit * metres, rtol=1e-6)
        np.testing.assert_allclose(predicted, unit * ahead, rtol=1e-6)
        assert std_there == pytest.approx(unit * std, rel=1e-6)


def test_somebody_who_walks_is_filtered_and_predicted():
    times, points = walk()
    filtered, predicted, std = follow(UnitFreeEstimator(CoordinatedTurnEstimator()), times, points)
    known = np.isfinite(filtered).all(axis=1)
    assert known.mean() > 0.85 and not known[:8].any()
    ahead = np.linalg.norm(predicted[20:-8, :2] - points[28:, :2], axis=1)
    assert np.median(ahead) < 0.08 and 0.005 < std < 0.3


def test_an_object_that_becomes_much_faster_or_slower_gets_another_unit():
    times = np.arange(240) / RATE
    speed = np.where(times < 3.0, 0.05, 2.0)
    points = np.column_stack([np.cumsum(speed) / RATE, np.zeros(240), np.zeros(240)])
    filtered = follow(UnitFreeEstimator(CoordinatedTurnEstimator()), times, points)[0]
    late = times > 4.5
    assert np.abs(filtered[late, 0] - points[late, 0]).max() < 0.02
    back = follow(UnitFreeEstimator(CoordinatedTurnEstimator()), times, points[::-1])[0]
    off = np.abs(back[:, 0] - points[::-1][:, 0])
    assert off[-30:].max() < 0.002 and off[-5:].max() < 0.0005


def test_good_points_on_a_winding_path_are_followed(monkeypatch):
    """The filter took its own errors for noise of the points: 6 px off, with points that are right to 0.2 px."""
    times = np.arange(300) / RATE
    rng = np.random.default_rng(3)
    path = np.column_stack([320.0 + 200.0 * np.sin(1.2 * times), 240.0 + 100.0 * np.sin(2.4 * times), 0.0 * times])
    points = path + rng.normal(0.0, 0.16, path.shape) * [1.0, 1.0, 0.0]
    rows = np.column_stack([times, points])
    assert noise_of(rows[:60]) == pytest.approx(0.16, rel=0.35)
    assert noise_of(1e3 * rows[:60]) == pytest.approx(1e3 * noise_of(rows[:60])) and noise_of(rows[:5]) == np.inf

    def errors():
        filtered, predicted, _ = follow(UnitFreeEstimator(CoordinatedTurnEstimator()), times, points)
        ahead = 0.5 * (path[40:-8] + path[41:-7])[7:] - predicted[40:-15]
        return np.median(np.linalg.norm(filtered[40:] - path[40:], axis=1)), np.median(np.linalg.norm(ahead, axis=1))

    filtered, ahead = errors()
    monkeypatch.setattr(scaled, "NOISE_FACTOR", 1e9)
    unlimited = errors()
    assert filtered < 1.2 and filtered < 0.3 * unlimited[0] and ahead < 0.7 * unlimited[1]


def test_the_unit_follows_from_speed_and_noise():
    times = np.arange(20) / RATE
    straight = np.column_stack([times, 3.0 * times, np.zeros(20), np.zeros(20)])
    assert unit_of(straight) == pytest.approx(3.0 / SPEED)
    rng = np.random.default_rng(1)
    still = np.column_stack([np.arange(300) / RATE, rng.normal(0.0, 2.0, (300, 3))])
    # The distance between two noisy points looks like speed: 2 / NOISE is the least unit.
    assert 2.0 / NOISE * 0.8 < unit_of(still) < 2.0 / NOISE * 2.0 * RATE
    assert unit_of(straight[:7]) == 0.0 and unit_of(np.column_stack([times, np.ones((20, 3))])) == 0.0


def test_it_is_an_estimator_and_ignores_what_is_no_point():
    estimator = UnitFreeEstimator(CoordinatedTurnEstimator())
    check_estimator(estimator)
    state = estimator.update(estimator.initial_state(), 1.0, np.array([1.0, 2.0, 3.0]))
    assert estimator.update(state, 2.0, np.array([np.nan, 0.0, 0.0])) is state
    assert estimator.update(state, 1.0, np.zeros(3)) is state and not estimator.ready(state)
    with pytest.raises(DrakeTrackerError):
        check_estimator(object())


@pytest.mark.parametrize("seed", range(3))
def test_an_object_that_starts_after_a_rest_is_filtered(seed):
    """Noise of the rest set the unit, in which the object then was so fast that a variance became negative, and the
    square root of it ended the command."""
    rng = np.random.default_rng(seed)
    times = 0.1 * np.arange(80)
    later = np.maximum(times - 3.0, 0.0)
    way = np.where(later < 1.0, 90.0 * later**2, 180.0 * later - 90.0)
    truth = np.column_stack([300.0 + 100.0 * np.sin(0.01 * way), 200.0 - 100.0 * np.cos(0.01 * way), 0.0 * way])
    points = truth + rng.normal(0.0, 0.003, truth.shape) * [1.0, 1.0, 0.0]
    estimator = own_estimator(CoordinatedTurn(), 0.1, in_pixels=True)
    state = estimator.initial_state()
    for time, point in zip(times, points):
        state = estimator.update(state, time, point)
    assert estimator.ready(state)
    np.testing.assert_allclose(estimator.predict(state, times[-1:])[0, :2], truth[-1, :2], atol=3.0)
