import copy

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import make_estimator

PERIOD = 1.0 / 60.0


def circle(t, speed=0.15, radius=0.12, climb=0.0):
    """Returns points (n, 3) of a circle about (.56, 0, .485); a negative speed runs it clockwise."""
    angle = speed * np.asarray(t) / radius
    return np.stack([0.56 + radius * np.cos(angle), radius * np.sin(angle), 0.485 + climb * np.asarray(t)], axis=-1)


def run(estimator, times, points):
    state = estimator.initial_state()
    for t, p in zip(times, points, strict=True):
        state = estimator.update(state, t, p)
    return state


def rms_error(estimator, sigma, horizon, seconds=8.0, speed=0.15):
    """Returns the rms distance [m] from the truth on a circle, white noise ``sigma`` [m] per axis."""
    times = PERIOD * np.arange(int(seconds / PERIOD))
    noise = sigma * np.random.default_rng(1000).normal(size=(len(times), 3))
    state = estimator.initial_state()
    errors = []
    for t, p in zip(times, circle(times, speed) + noise, strict=True):
        state = estimator.update(state, t, p)
        if t > 1.5:
            predicted = estimator.predict(state, [t + horizon])[0, :2]
            errors.append(np.linalg.norm(predicted - circle(t + horizon, speed)[:2]))
    return np.sqrt(np.mean(np.square(errors)))


@pytest.mark.parametrize("mode", ["baseline", "literal"])
@pytest.mark.parametrize("speed", [0.1, -0.2])
def test_circle_without_noise_is_predicted_exactly(mode, speed):
    estimator = make_estimator("arc_length", mode=mode)
    times = PERIOD * np.arange(120)
    state = run(estimator, times, circle(times, speed, climb=0.01))
    ahead = times[-1] + np.linspace(-0.05, 1.6, 34)
    rows = estimator.predict(state, ahead)
    np.testing.assert_allclose(rows[:, :3], circle(ahead, speed, climb=0.01), atol=1e-6)
    tangent = speed * ahead / 0.12 + np.copysign(np.pi / 2, speed)
    assert np.ptp(np.unwrap(rows[:, 3] - tangent)) < 1e-6
    assert np.cos(rows[0, 3] - tangent[0]) == pytest.approx(1.0)


def test_straight_line_is_predicted_exactly():
    estimator = make_estimator("arc_length")
    times = PERIOD * np.arange(90)
    points = np.stack([0.2 * times, 0.1 * times, np.full(90, 0.485)], axis=-1)
    state = run(estimator, times, points)
    row = estimator.predict(state, [times[-1] + 0.75])[0]
    np.testing.assert_allclose(row[:2], (times[-1] + 0.75) * np.array([0.2, 0.1]), atol=1e-6)
    assert row[3] == pytest.approx(np.arctan2(0.1, 0.2))


def test_literal_reading_fails_at_a_millimetre_of_noise_where_the_baseline_does_not():
    assert rms_error(make_estimator("arc_length", mode="literal"), 0.001, 0.0) > 0.02
    assert rms_error(make_estimator("arc_length"), 0.001, 0.0) < 0.0015
    assert rms_error(make_estimator("arc_length"), 0.001, 0.75) < 0.008


def test_literal_reading_works_where_the_chord_is_long_against_the_noise():
    assert rms_error(make_estimator("arc_length", mode="literal"), 0.0001, 0.0) < 0.004


def test_estimates_noise_and_speed_and_chooses_the_baseline_by_them():
    estimator = make_estimator("arc_length")
    times = PERIOD * np.arange(240)
    rng = np.random.default_rng(1001)
    states = {}
    for sigma in (0.0005, 0.002):
        states[sigma] = run(estimator, times, circle(times) + sigma * rng.normal(size=(240, 3)))
        assert states[sigma].speed == pytest.approx(0.15, rel=0.1)
        assert states[sigma].sigma == pytest.approx(sigma, rel=0.4)
    assert 3 <= states[0.0005].arc.baseline < states[0.002].arc.baseline <= 20


@pytest.mark.parametrize("baseline, bending_order", [(1, 40), (30, 6), (50, 40)])
def test_a_given_baseline_is_used_and_exact_on_a_circle(baseline, bending_order):
    estimator = make_estimator("arc_length", baseline=baseline, bending_order=bending_order)
    times = PERIOD * np.arange(200)
    state = run(estimator, times, circle(times))
    assert state.arc.baseline == baseline
    np.testing.assert_allclose(estimator.predict(state, [4.0])[0, :3], circle(4.0), atol=1e-6)


def test_missing_points_and_trouble_do_no_harm():
    estimator = make_estimator("arc_length")
    times = PERIOD * np.arange(240)
    points = circle(times)
    state = estimator.initial_state()
    rng = np.random.default_rng(1002)
    for t, p in zip(times, points, strict=True):
        state = estimator.update(state, t, p if rng.uniform() < 0.6 else None)
    last = state.stamp
    for stamp, p in [(last - 0.1, points[0]), (last, points[0]), (np.nan, points[0]), (last + 1, np.full(3, np.nan))]:
        assert estimator.update(state, stamp, p) is state
    rows = estimator.predict(state, [last, last + 0.75])
    np.testing.assert_allclose(rows[:, :3], circle(np.array([last, last + 0.75])), atol=2e-3)


def test_a_long_gap_starts_the_window_afresh():
    estimator = make_estimator("arc_length")
    times = PERIOD * np.arange(120)
    state = run(estimator, times, circle(times))
    assert estimator.ready(state)
    state = estimator.update(state, 5.0, circle(5.0))
    assert not estimator.ready(state) and len(state.times) == 1
    np.testing.assert_allclose(estimator.predict(state, [5.5])[0, :3], circle(5.0))
    for t in 5.0 + PERIOD * np.arange(1, 60):
        state = estimator.update(state, t, circle(t))
    assert estimator.ready(state)
    np.testing.assert_allclose(estimator.predict(state, [6.5])[0, :3], circle(6.5), atol=1e-6)


def test_an_object_at_rest_keeps_its_place_and_last_heading():
    estimator = make_estimator("arc_length")
    times = PERIOD * np.arange(300)
    line = np.stack([np.minimum(0.15 * times, 0.3), np.zeros(300), np.full(300, 0.485)], axis=-1)
    for noise in (0.0, 0.001):
        state = run(estimator, times, line + noise * np.random.default_rng(1003).normal(size=line.shape))
        rows = estimator.predict(state, times[-1] + np.linspace(0.0, 1.6, 5))
        np.testing.assert_allclose(rows[:, :2] - [0.3, 0.0], 0.0, atol=0.015)
        assert np.all(np.isfinite(rows)) and np.all(np.isfinite(estimator.predict_std(state, times)))
        assert np.all(np.abs(np.angle(np.exp(1j * rows[:, 3]))) < (1e-6 if noise == 0.0 else 0.5))


@pytest.mark.parametrize("kind", ["arc_length", "alpha_beta_gamma"])
def test_never_a_nan_from_the_first_point_on(kind):
    estimator = make_estimator(kind)
    state = estimator.initial_state()
    assert not estimator.ready(state)
    assert np.all(np.isfinite(estimator.predict(state, [0.0, 1.0])))
    assert estimator.update(state, 0.0, None) is state
    for k in range(60):  # the same point again and again: no length, no direction
        state = estimator.update(state, k * PERIOD, np.array([0.5, 0.1, 0.48]))
        rows = estimator.predict(state, [k * PERIOD, k * PERIOD + 1.0])
        np.testing.assert_allclose(rows, [[0.5, 0.1, 0.48, 0.0]] * 2, atol=1e-9)
        assert np.all(np.isfinite(estimator.predict_std(state, [k * PERIOD, k * PERIOD + 1.0])))


@pytest.mark.parametrize("kind", ["arc_length", "alpha_beta_gamma"])
def test_state_is_immutable_and_its_own_copy(kind):
    estimator = make_estimator(kind)
    times = PERIOD * np.arange(60)
    state = run(estimator, times, circle(times))
    before = estimator.predict(state, [1.5])
    estimator.update(state, 1.0, np.array([9.0, 9.0, 9.0]))
    np.testing.assert_array_equal(estimator.predict(state, [1.5]), before)
    assert copy.deepcopy(state) is state
    for name in ("times", "points"):
        if hasattr(state, name):
            assert not getattr(state, name).flags.writeable


def test_predicted_error_matches_the_errors_made():
    estimator = make_estimator("arc_length", systematic_std=0.0)
    times = PERIOD * np.arange(1200)
    points = circle(times) + 0.002 * np.random.default_rng(1004).normal(size=(1200, 3))
    state = estimator.initial_state()
    errors, stds = [], []
    for t, p in zip(times, points, strict=True):
        state = estimator.update(state, t, p)
        if t > 3.0:
            errors.append(np.linalg.norm(estimator.predict(state, [t + 0.5])[0, :2] - circle(t + 0.5)[:2]))
            stds.append(estimator.predict_std(state, [t + 0.5])[0])
    ratio = np.sqrt(np.mean(np.square(stds)) / np.mean(np.square(errors)))
    assert 0.7 < ratio < 1.6


@pytest.mark.parametrize(
    "parameters, named",
    [
        ({"mode": "both"}, "mode"),
        ({"order": 0}, "order is 0"),
        ({"order": 30.0}, "order is 30.0"),
        ({"baseline_range": (5, 3)}, "baseline_range"),
        ({"baseline_range": (1, 2, 3)}, "baseline_range"),
        ({"period": 0.0}, "period"),
        ({"colour": 1}, "colour"),
    ],
)
def test_bad_parameters_are_named(parameters, named):
    with pytest.raises(DrakeTrackerError, match=named):
        make_estimator("arc_length", **parameters)


def test_unknown_kind_lists_the_known():
    with pytest.raises(DrakeTrackerError, match="alpha_beta_gamma, arc_length"):
        make_estimator("kalman")


def helix(t, speed=0.15, radius=0.11, pitch=0.26):
    """Returns points (n, 3) of a helix about a vertical axis, climbing at an angle ``pitch`` [rad]."""
    return circle(t, speed * np.cos(pitch), radius, climb=abs(speed) * np.sin(pitch))


def hill(t, speed=0.15, radius=0.16, height=0.04):
    """Returns points (n, 3) of a circle seen from above that rises and falls once per lap by +-height [m]."""
    angle = np.linspace(0.0, 4.0 * np.pi, 20001)
    path = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.5 + height * np.sin(angle)], axis=-1)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    return np.stack([np.interp(speed * np.asarray(t), length, column) for column in path.T], axis=-1)


def error_ahead(mode, path, seeds=3, sigma=0.001, horizon=0.75):
    """Returns the rms distance [m] over all three axes between predictions and a path."""
    squares, times = [], PERIOD * np.arange(420)
    for seed in range(seeds):
        estimator, noise = make_estimator("arc_length", mode=mode), np.random.default_rng(2000 + seed)
        state = estimator.initial_state()
        for k, point in enumerate(path(times) + sigma * noise.normal(size=(420, 3))):
            state = estimator.update(state, times[k], point)
            if k > 150 and k % 10 == 0:
                ahead = times[k] + horizon
                squares.append(np.sum((estimator.predict(state, [ahead])[0, :3] - path(np.array([ahead]))[0]) ** 2))
    return np.sqrt(np.mean(squares))


@pytest.mark.parametrize("speed", [0.1, -0.2])
def test_helix_without_noise_is_predicted_exactly_in_space(speed):
    estimator = make_estimator("arc_length", mode="space")
    times = PERIOD * np.arange(240)
    state = run(estimator, times, helix(times, speed))
    ahead = times[-1] + np.linspace(-0.05, 1.6, 34)
    rows = estimator.predict(state, ahead)
    np.testing.assert_allclose(rows[:, :3], helix(ahead, speed), atol=2e-6)
    tangent = speed * np.cos(0.26) * ahead / 0.11 + np.copysign(np.pi / 2, speed)
    np.testing.assert_allclose(np.exp(1j * (rows[:, 3] - tangent)), 1.0, atol=1e-4)


def test_in_space_a_hill_is_predicted_better_than_by_a_steady_climb():
    assert error_ahead("space", hill) < 0.65 * error_ahead("baseline", hill)


def test_in_space_three_axes_cost_little_more_than_two():
    """On a helix as curved as the circle, with the error per axis."""
    in_plane = error_ahead("baseline", lambda t: circle(t, 0.15, 0.12))
    in_space = error_ahead("space", lambda t: helix(t, 0.15, 0.12 * np.cos(0.26) ** 2))
    assert in_space / np.sqrt(3.0) < 1.25 * in_plane / np.sqrt(2.0)


def test_in_space_standing_objects_gaps_and_tight_turns_do_no_harm():
    estimator, times = make_estimator("arc_length", mode="space"), PERIOD * np.arange(240)
    rng = np.random.default_rng(1008)
    resting = run(estimator, times, [0.5, 0.1, 0.5] + 0.001 * rng.normal(size=(240, 3)))
    assert resting.speed < 0.01
    np.testing.assert_allclose(estimator.predict(resting, [5.0])[0, :3], [0.5, 0.1, 0.5], atol=0.002)
    tight = run(estimator, times, circle(times, 0.3, 0.03) + 0.001 * rng.normal(size=(240, 3)))
    np.testing.assert_allclose(
        estimator.predict(tight, [times[-1] + 0.25])[0, :3], circle(times[-1] + 0.25, 0.3, 0.03), atol=0.02
    )
    state = estimator.initial_state()
    for t, p in zip(times, helix(times), strict=True):
        state = estimator.update(state, t, p if rng.uniform() < 0.6 else None)
    np.testing.assert_allclose(
        estimator.predict(state, [state.stamp + 0.5])[0, :3], helix(state.stamp + 0.5), atol=3e-3
    )


NO_PATHS = {
    "one place": lambda rng, t: np.tile([0.5, 0.1, 0.5], (len(t), 1)),
    "two places in turn": lambda rng, t: np.where(np.arange(len(t))[:, None] % 2, [0.5, 0.1, 0.5], [0.4, 0.2, 0.6]),
    "to and fro": lambda rng, t: np.outer(0.1 * np.abs((t % 0.4) - 0.2), [1.0, 0.5, 0.2]) + [0.5, 0.0, 0.5],
    "anywhere": lambda rng, t: rng.uniform(-1.0, 1.0, (len(t), 3)),
    "leaps": lambda rng, t: circle(t) + 0.2 * np.repeat(rng.integers(0, 2, (len(t) // 8, 3)), 8, axis=0),
    "a spinning top": lambda rng, t: circle(t, 0.5, 0.002),
    "far away": lambda rng, t: 1e3 * circle(t),
    "a line": lambda rng, t: np.outer(t, [0.1, 0.0, 0.05]),
}


@pytest.mark.parametrize("mode", ["baseline", "space"])
@pytest.mark.parametrize("name", NO_PATHS)
def test_points_without_a_path_give_finite_predictions(name, mode):
    """In a run, points that leapt between train and hand once left no axis, and the fit in space a singular matrix."""
    times = PERIOD * np.arange(200)
    for sigma in (0.0, 1e-3):
        rng = np.random.default_rng(2)
        points = NO_PATHS[name](rng, times)
        estimator = make_estimator("arc_length", mode=mode)
        state = estimator.initial_state()
        for t, p in zip(times, points + sigma * rng.normal(size=points.shape), strict=True):
            state = estimator.update(state, t, p)
            assert np.isfinite(estimator.predict(state, [t, t + 0.75])).all()
