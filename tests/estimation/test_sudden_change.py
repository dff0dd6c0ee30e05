"""Sudden changes of speed, noticed by an estimator that wraps another one."""

from functools import cache

import numpy as np
import pytest

from drake_tracker.estimation.estimator import check_estimator, make_estimator
from drake_tracker.estimation.parts.speed_change import SpeedChange
from drake_tracker.estimation.sudden_change import (
    WINDOW,
    SuddenChangeEstimator,
    shows_in_distance,
    with_speed_change_detection,
)

PERIOD = 1.0 / 60.0
RADIUS = 0.15
SPEED = 0.2
BRAKING = 2.4
"""How fast the train of the laboratory changes its speed [m/s^2]."""
AHEAD = 0.3
KINDS = ("closed_path", "coordinated_turn")


def driven(times, factor, at):
    """Returns distances (n,) [m]: the speed changes by a factor at a time [s], as fast as the train can."""
    fine = np.arange(0.0, times[-1] + 1.0, 1e-3)
    change = np.clip((fine - at) * BRAKING, 0.0, abs(factor - 1.0) * SPEED)
    return np.interp(times, fine, np.cumsum(SPEED + np.sign(factor - 1.0) * change) * 1e-3)


def places(distances):
    """Returns points on a circle, shape (n, 3) [m]."""
    angles = np.asarray(distances) / RADIUS
    return np.column_stack([0.56 + RADIUS * np.cos(angles), RADIUS * np.sin(angles), np.full(len(angles), 0.485)])


def run(estimator, factor=1.0, at=np.inf, duration=8.0, sigma=0.001, seed=0, offset=None, after=()):
    """Feeds points on a circle; yields (stamp, state).

    ``after``: the states after the first points, when another run has already fed the same ones.
    """
    times = PERIOD * np.arange(1, round(duration / PERIOD))
    points = places(driven(times, factor, at))
    points += sigma * np.random.default_rng(seed).standard_normal(points.shape)
    if offset is not None:
        points += offset(times)[:, None] * [1.0, 0.0, 0.0]
    state = after[-1] if after else estimator.initial_state()
    for stamp, point in zip(times[len(after) :], points[len(after) :], strict=True):
        state = estimator.update(state, stamp, point)
        yield stamp, state


def wrapped(kind, detects):
    """Returns the estimator of a kind, with or without the detection of sudden changes."""
    estimator = make_estimator(kind)
    return with_speed_change_detection(estimator) if detects else estimator


@cache
def undisturbed(kind, detects, seed):
    """Returns the states after each point at constant speed. Every change of speed starts from one of them."""
    return tuple(state for _, state in run(wrapped(kind, detects), seed=seed))


def errors_after(detects, factor, at, seed):
    """Returns the errors [m] of positions predicted `AHEAD` from 6 to 12 points after a change."""
    estimator, errors = wrapped("closed_path", detects), []
    before = undisturbed("closed_path", detects, seed)[: int(at / PERIOD) - 2]
    for stamp, state in run(estimator, factor, at, at + 0.22, seed=seed, after=before):
        if stamp >= at + 6 * PERIOD:
            expected = places(driven(np.array([stamp + AHEAD]), factor, at))[0, :2]
            errors.append(np.hypot(*(estimator.predict(state, np.array([stamp + AHEAD]))[0, :2] - expected)))
    return errors


@pytest.mark.parametrize("factor", [1.0, 0.5, 1.5])
def test_a_run_from_a_shared_state_is_the_whole_run(factor):
    """Before a change, the points do not depend on it, and no state is changed by what follows."""
    estimator = wrapped("closed_path", True)
    before = undisturbed("closed_path", True, 0)[:179]
    *_, (_, resumed) = run(estimator, factor, 3.02, 3.3, after=before)
    *_, (_, whole) = run(estimator, factor, 3.02, 3.3)
    ahead = np.array([3.3, 4.0])
    np.testing.assert_array_equal(estimator.predict(resumed, ahead), estimator.predict(whole, ahead))


@pytest.mark.parametrize("at", [3.02, 7.51], ids=["before the path closes", "afterwards"])
@pytest.mark.parametrize("factor", [0.5, 1.5, 0.0])
def test_six_points_after_a_change_of_speed_it_predicts_the_new_one(factor, at):
    new, old = (
        np.concatenate([errors_after(detects, factor, at, seed) for seed in range(8)]) for detects in (True, False)
    )
    assert np.median(new) < 0.009
    assert np.median(new) < 0.6 * np.median(old)


@pytest.mark.parametrize("kind", KINDS)
def test_at_constant_speed_it_notices_nothing(kind):
    """Twelve runs of 8 s, nearly 6000 tests of the newest points."""
    assert all(state.changed is None for seed in range(12) for state in undisturbed(kind, True, seed))


@pytest.mark.parametrize("kind", KINDS)
def test_at_constant_speed_it_predicts_the_same(kind):
    plain, detecting = wrapped(kind, False), wrapped(kind, True)
    for seed in range(2):
        state, same = (undisturbed(kind, detects, seed)[-1] for detects in (True, False))
        times = PERIOD * len(undisturbed(kind, True, seed)) + np.array([0.0, 0.3, 1.0])
        np.testing.assert_array_equal(detecting.predict(state, times), plain.predict(same, times))
        np.testing.assert_array_equal(detecting.predict_std(state, times), plain.predict_std(same, times))


@pytest.mark.parametrize("kind", KINDS)
def test_a_change_becomes_the_past_and_the_next_one_is_noticed(kind):
    estimator = with_speed_change_detection(make_estimator(kind))
    noticed = [(stamp, state) for stamp, state in run(estimator, 0.5, 6.5, 7.5, seed=2)]
    changed = [stamp for stamp, state in noticed if state.changed is not None]
    assert 6.5 + 3 * PERIOD < changed[0] < 6.5 + 8 * PERIOD
    assert changed[-1] < 6.5 + (WINDOW + 4) * PERIOD
    rate = np.diff(estimator.predict(noticed[-1][1], 7.5 + np.array([0.0, 0.1]))[:, :2], axis=0)
    assert np.hypot(*rate[0]) == pytest.approx(0.01, abs=0.001)
    assert all(len(state.recent) <= WINDOW + 1 for _, state in noticed)


@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_the_filter_is_given_the_change_with_its_sign(factor, monkeypatch):
    """A filter recovers from a wrong sign within a few points, so that its predictions alone do not show it."""
    gains, filter_ = [], make_estimator("coordinated_turn")
    with_speed = type(filter_).with_speed

    def record(self, state, gain, std):
        gains.append(gain)
        return with_speed(self, state, gain, std)

    monkeypatch.setattr(type(filter_), "with_speed", record)
    before = undisturbed("coordinated_turn", True, 2)[:387]
    list(run(with_speed_change_detection(filter_), factor, 6.5, 6.8, seed=2, after=before))
    assert np.median(gains) == pytest.approx((factor - 1.0) * SPEED, abs=0.03)


@pytest.mark.parametrize("kind", KINDS)
def test_a_jump_and_outliers_are_no_change_of_speed(kind):
    def jump(times):
        return 0.004 * (times > 6.5)

    def outliers(times):
        return 0.02 * (np.arange(len(times)) % 97 == 0)

    for offset in (jump, outliers):
        noticed = [
            state.changed is not None
            for _, state in run(with_speed_change_detection(make_estimator(kind)), offset=offset)
        ]
        assert sum(noticed) == 0


def test_the_closed_path_is_not_learned_while_the_speed_changes():
    """The speed that is estimated when the path has just closed would be that before the change."""
    plain = make_estimator("closed_path")
    closes = next(stamp for stamp, state in run(plain) if state.following is not None)
    at = closes - 4.5 * PERIOD
    for stamp, state in run(with_speed_change_detection(plain), 0.5, at, at + 1.0):
        if state.changed is not None and stamp < at + 0.2:
            assert state.present.following is None
    assert state.present.following is not None


def test_an_estimator_that_cannot_be_told_the_speed_stays_as_it_is():
    for kind in ("arc_length", "alpha_beta_gamma"):
        estimator = make_estimator(kind, period=PERIOD)
        assert with_speed_change_detection(estimator) is estimator
    assert isinstance(with_speed_change_detection(make_estimator("closed_path")), SuddenChangeEstimator)


@pytest.mark.parametrize("kind", KINDS)
def test_it_satisfies_the_interface(kind):
    check_estimator(with_speed_change_detection(make_estimator(kind)), kind)


def bending(shape):
    """Returns places and length of a closed path with sharp bends: a function of distances [m], and its length [m]."""
    u = np.linspace(0.0, 2.0 * np.pi, 4001)
    radius = 0.12 * (1.0 + 0.16 * np.cos(5.0 * u))
    x, y = {
        "ellipse": (0.05 * np.cos(u), 0.15 * np.sin(u)),
        "five lobes": (radius * np.cos(u), radius * np.sin(u)),
        "figure eight": (0.08 * np.sin(2.0 * u), 0.15 * np.sin(u)),
    }[shape]
    s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return lambda d: np.column_stack([np.interp(np.asarray(d) % s[-1], s, x), np.interp(np.asarray(d) % s[-1], s, y)])


@pytest.mark.parametrize("shape", ["ellipse", "five lobes", "figure eight"])
def test_a_bend_is_no_change_of_speed(shape):
    """Each bend once shifted the distance travelled, so that the lap never closed: 170 mm of error 0.75 s ahead."""
    at, estimator = bending(shape), with_speed_change_detection(make_estimator("closed_path"))
    times = PERIOD * np.arange(1, round(14.0 / PERIOD))
    points = np.column_stack([at(SPEED * times), np.full(len(times), 0.485)])
    points += 0.001 * np.random.default_rng(4).standard_normal(points.shape)
    state, noticed, errors = estimator.initial_state(), 0, []
    for stamp, point in zip(times, points, strict=True):
        state = estimator.update(state, stamp, point)
        noticed += state.changed is not None
        if stamp > 12.0:
            ahead = stamp + np.array([0.75])
            errors.append(np.hypot(*(estimator.predict(state, ahead)[0, :2] - at(SPEED * ahead)[0])))
    assert noticed < 4
    assert np.median(errors) < 0.006


@pytest.mark.parametrize(("speed", "noise"), [(0.05, 0.001), (0.1, 0.001), (0.2, 0.001), (0.4, 0.001)])
@pytest.mark.parametrize("factor", [0.0, 1.8])
def test_a_change_shows_in_the_distance_beside_the_noise_of_the_points(speed, noise, factor):
    """Noise lengthens short chords: a stop at 0.05 m/s was taken for no change in four of five cases."""
    times, rng, shown = np.arange(1, WINDOW + 1) / 60.0, np.random.default_rng(3), []
    expected = np.column_stack([speed * times, 0.0 * times])
    for first in np.tile(np.arange(3, 8), 40):
        change = SpeedChange(int(first), (factor - 1.0) * speed, 100.0, 100.0)
        along = np.maximum(times - times[first], 0.0) * change.gain
        away = np.column_stack([along, 0.0 * along]) + rng.normal(0.0, noise, expected.shape)
        shown.append(shows_in_distance(change, times, expected, away))
    assert np.mean(shown) > 0.7
