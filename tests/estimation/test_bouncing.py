"""Bounces, noticed by an estimator that wraps another one, at any scale and rate."""

import numpy as np
import pytest

from drake_tracker.estimation.bouncing import BouncingEstimator, noticing_bounces
from drake_tracker.estimation.config import AlphaBetaGamma, CoordinatedTurn
from drake_tracker.estimation.estimator import check_estimator, make_estimator
from drake_tracker.estimation.parts.bounce import INSTANTS, most_likely_bounce
from drake_tracker.estimation.parts.speed_change import PLACE_STD, REFERENCE_NOISE, SPEED_STD
from drake_tracker.own_cameras.scale import own_estimator

SIZE = np.array([580.0, 420.0])


def ball(times, speed, angle):
    """Returns places (n, 3) of a ball between the edges of an image [px], and how often it has bounced (n,)."""
    way = 100.0 + speed * times[:, None] * [np.cos(angle), np.sin(angle)]
    return np.column_stack([SIZE - np.abs(way % (2.0 * SIZE) - SIZE), np.zeros(len(times))]), (way // SIZE).sum(axis=1)


def follow(points, times, period):
    """Returns what is filtered, and what was predicted 0.25 s ahead (n, 3); NaN while there is none."""
    estimator = own_estimator(CoordinatedTurn(), period)
    state = estimator.initial_state()
    filtered, ahead = np.full((2, len(points), 3), np.nan)
    for k, (time, point) in enumerate(zip(times.tolist(), points)):
        state = estimator.update(state, time, point)
        if estimator.ready(state):
            filtered[k], ahead[k] = estimator.predict(state, np.array([time, time + 0.25]))[:, :3]
    return filtered, ahead


@pytest.mark.parametrize("unit", [1.0, 0.002])
@pytest.mark.parametrize(("rate", "late"), [(15.0, 2), (30.0, 3), (120.0, 6)])
def test_a_ball_that_bounces_is_followed_after_two_or_three_images(rate, late, unit):
    off = []
    for seed in range(6):
        times = np.arange(0.0, 4.0, 1.0 / rate)
        true, bounces = ball(times, 300.0, 0.5 + 0.2 * seed)
        noise = np.random.default_rng(seed).normal(0.0, 0.5, true.shape) * [1.0, 1.0, 0.0]
        filtered, _ = follow(unit * (true + noise), times, 1.0 / rate)
        first = np.flatnonzero(np.diff(bounces, prepend=bounces[0]) == 1)
        since = [
            k - first[first <= k].max() + 1 if k >= first.min(initial=len(times)) else 0 for k in range(len(times))
        ]
        counted = (np.array(since) >= late) & (times > 0.7)
        off.append(np.linalg.norm(filtered / unit - true, axis=1)[counted])
    off = np.concatenate(off)
    assert np.isfinite(off).all() and len(off) > 100
    assert np.median(off) < 0.5 and np.mean(off < 3.0 * 0.5) > 0.95


def test_the_path_after_a_bounce_is_predicted():
    times = np.arange(0.0, 2.4, 1.0 / 30.0)
    true = np.column_stack([np.abs(2.0 * (times - 1.21)), 0.3 * times, np.zeros(len(times))])
    noisy = true + np.random.default_rng(0).normal(0.0, 0.003, true.shape)
    filtered, ahead = follow(noisy, times, 1.0 / 30.0)
    after = np.flatnonzero(times > 1.21)
    predicted = [2.0 * (times[after] + 0.25 - 1.21), 0.3 * (times[after] + 0.25)]
    off = np.linalg.norm(ahead[after, :2] - np.transpose(predicted), axis=1)
    assert off[3:9].max() < 0.06 and np.abs(filtered[after, :2] - true[after, :2])[2:].max() < 0.009


@pytest.mark.parametrize("run", [1, 2])
def test_outliers_are_no_bounces(run):
    times = np.arange(0.0, 4.0, 1.0 / 30.0)
    rng = np.random.default_rng(3)
    true = np.column_stack([300.0 + 120.0 * np.cos(0.7 * times), 200.0 + 120.0 * np.sin(0.7 * times), 0.0 * times])
    noisy = true + rng.normal(0.0, 0.5, true.shape) * [1.0, 1.0, 0.0]
    for first in range(30, 110, 20):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        noisy[first : first + run] += 60.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
    filtered, _ = follow(noisy, times, 1.0 / 30.0)
    assert np.nanmax(np.linalg.norm(filtered - true, axis=1)[20:]) < 5.0


def test_somebody_who_walks_does_not_bounce():
    """The sway of a walking figure leaves the filter as it is, bit for bit."""
    times = np.arange(0.0, 4.0, 1.0 / 30.0)
    points = np.column_stack([1.3 * times, 0.2 * times, np.full(len(times), 0.9)])
    points += 0.03 * np.sin(2.0 * np.pi * 1.8 * times)[:, None] + np.random.default_rng(1).normal(
        0, 0.005, points.shape
    )
    points *= 0.15 / 1.3
    plain = make_estimator(CoordinatedTurn())
    noticing = BouncingEstimator(plain)
    one, other = plain.initial_state(), noticing.initial_state()
    for time, point in zip(times.tolist(), points):
        one, other = plain.update(one, time, point), noticing.update(other, time, point)
        np.testing.assert_array_equal(plain.predict(one, [time + 0.3]), noticing.predict(other, np.array([time + 0.3])))


def test_a_bounce_is_told_from_a_jump_and_from_an_outlier():
    times = np.arange(1, 9) / 30.0
    gain = np.array([-0.2, 0.1, 0.0])
    bounce = most_likely_bounce(times, np.outer(np.maximum(times - 5.5 / 30.0, 0.0), gain))
    assert bounce.after == 3 and bounce.margin > 0.0 and bounce.misfit < 0.01
    np.testing.assert_allclose(bounce.gain, gain, rtol=0.02)
    assert most_likely_bounce(times, np.outer(times > 5.5 / 30.0, gain)).margin < 0.0
    assert most_likely_bounce(times, np.outer(times > 7.5 / 30.0, gain)).margin < 0.0
    assert most_likely_bounce(times[:1], np.zeros((1, 3))) is None


def test_the_evidence_is_twice_the_log_likelihood_ratio():
    rng = np.random.default_rng(5)
    times, after = np.arange(1, 9) / 30.0, 3
    ramp = np.maximum(times - times[-after - 1], 0.0)
    away = np.outer(ramp, [0.2, -0.1]) + 0.0005 * rng.normal(size=(8, 2))
    found = most_likely_bounce(times, away)
    assert found.after == after
    spread = PLACE_STD**2 + SPEED_STD**2 * np.outer(times, times) + REFERENCE_NOISE**2 * np.eye(8)

    def misfit(left):
        return float(np.sum(left * np.linalg.solve(spread, left)))

    starts = times[-after - 1] + np.arange(INSTANTS) / INSTANTS / 30.0
    best = min(misfit(away - np.outer(np.maximum(times - start, 0.0), found.gain)) for start in starts)
    assert found.evidence == pytest.approx(misfit(away) - best)


def test_it_is_an_estimator_and_needs_one_that_can_start_again():
    check_estimator(BouncingEstimator(make_estimator(CoordinatedTurn())))
    other = make_estimator(AlphaBetaGamma())
    assert noticing_bounces(other) is other
