import math

import numpy as np
import pytest
from slopes import LAG, LENGTH, PERIOD, RADIUS, STEP, WIDTH, board_pose, points_of, roll, to_world

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import make_estimator

X_WB = board_pose()
ACCELERATION = 0.6 * 9.81 * math.sin(math.radians(10.0))
BALLS = 120


def slope(**settings):
    return make_estimator("inclined_plane", X_WB=X_WB, **settings)


def watch(estimator, stamps, points):
    """Returns the states after each of the points (n, 2) [m, B]."""
    state, states = estimator.initial_state(), []
    for stamp, p_WQ in zip(stamps, to_world(points, X_WB)):
        state = estimator.update(state, stamp, p_WQ)
        states.append(state)
    return states


def to_board(rows):
    return (rows[:, :3] - X_WB[:3, 3]) @ X_WB[:3, :3]


def free(times, x=0.1, y=0.84, vx=0.0, vy=0.0):
    """Places (n, 2) [m, B] of a ball that meets nothing."""
    times = np.asarray(times)
    return np.column_stack([x + vx * times, y + vy * times - 0.5 * ACCELERATION * times**2])


@pytest.fixture(scope="module")
def rolled():
    return roll(BALLS, seed=5)


@pytest.fixture(scope="module")
def balls(rolled):
    """What was foreseen of many balls among pegs.

    Rows (horizon [s], error of x [m], error of time [s], std of x, std of time, clean). The horizon is the
    time to the crossing at which the arm would know it; clean: nothing was hit any more.
    """
    paths, times, hits = rolled
    rng, estimator, rows = np.random.default_rng(3), slope(), []
    for path, end, hit in zip(paths.transpose(1, 0, 2), times, hits):
        stamps, points = points_of(path, end, rng, phase=rng.random())
        exits = [estimator.exit(state) for state in watch(estimator, stamps, points)]
        x = path[round(end / STEP), 0]
        for horizon in (0.2, 0.25, 0.4, 0.6):
            k = np.searchsorted(stamps, end - horizon - LAG) - 1
            found = exits[k] if k >= 0 else None
            clean = hit < end - horizon - LAG - 3 * PERIOD
            rows.append(
                (horizon, found.x - x, found.time - end, found.std_x, found.std_time, clean)
                if found
                else (horizon, np.nan, np.nan, np.nan, np.nan, False)
            )
    return np.array(rows)


@pytest.mark.parametrize("horizon, median, share", [(0.2, 0.010, 0.75), (0.25, 0.012, 0.70), (0.4, 0.025, 0.52)])
def test_where_a_ball_among_pegs_comes_out(balls, horizon, median, share):
    """Pegs that are hit between what is known and the crossing set the limit, whatever the filter."""
    error = np.nan_to_num(abs(balls[balls[:, 0] == horizon, 1]), nan=1.0)
    assert np.median(error) < median
    assert np.mean(error < 0.030) > share


def test_it_beats_a_ball_that_would_fall_straight_down(balls, rolled):
    paths, times, _ = rolled
    known = np.rint((times - 0.25 - LAG) / STEP).astype(int)
    each = zip(paths.transpose(1, 0, 2), known, times)
    straight = [abs(path[k, 0] - path[round(end / STEP), 0]) for path, k, end in each]
    error = np.nan_to_num(abs(balls[balls[:, 0] == 0.25, 1]), nan=1.0)
    assert np.mean(error < 0.03) > 1.5 * np.mean(np.array(straight) < 0.03)


def test_its_own_idea_of_its_error_is_honest_where_nothing_is_hit_any_more(balls):
    clean = balls[balls[:, 5] == 1.0]
    assert len(clean) > 100
    assert 0.58 < np.mean(abs(clean[:, 1]) < clean[:, 3]) < 0.85
    assert 0.58 < np.mean(abs(clean[:, 2]) < clean[:, 4]) < 0.90


def test_predict_std_is_honest_on_a_board_without_pegs():
    paths, times, _ = roll(60, seed=2, pegs=False, start_speed=0.3)
    rng, estimator, within = np.random.default_rng(1), slope(), []
    for path, end in zip(paths.transpose(1, 0, 2), times):
        stamps, points = points_of(path, end - 0.35, rng)
        for state in watch(estimator, stamps, points)[6::2]:
            ask = [state.stamp + 0.3]
            error = to_board(estimator.predict(state, ask))[0, :2] - path[round(ask[0] / STEP)]
            within.append(np.hypot(*error) < estimator.predict_std(state, ask)[0])
    assert 0.58 < np.mean(within) < 0.85


def test_a_ball_that_meets_nothing_is_predicted_to_the_edge_and_beyond():
    estimator = slope()
    stamps = PERIOD * np.arange(9)
    state = watch(estimator, stamps, free(stamps, vx=0.1))[-1]
    leaves = math.sqrt(2 * 0.84 / ACCELERATION)
    found = estimator.exit(state)
    assert found.time == pytest.approx(leaves, abs=0.002)
    assert found.x == pytest.approx(0.1 + 0.1 * leaves, abs=0.002)
    assert found.speed == pytest.approx(ACCELERATION * leaves, abs=0.01)
    np.testing.assert_allclose(found.p_WQ, to_world([[found.x, 0.0]], X_WB)[0], atol=1e-12)
    times = np.array([leaves - 0.1, leaves + 0.1])
    on, off = to_board(estimator.predict(state, times))
    np.testing.assert_allclose(on, [*free([leaves - 0.1], vx=0.1)[0], RADIUS], atol=0.003)
    fall = 0.5 * 9.81 * 0.01  # in the air nothing holds it: gravity's part along the slope is whole
    s, c = math.sin(math.radians(10.0)), math.cos(math.radians(10.0))
    expected = [0.1 + 0.1 * times[1], -0.1 * found.speed - fall * s, RADIUS - fall * c]
    np.testing.assert_allclose(off, expected, atol=0.003)
    yaw = estimator.predict(state, times)[:, 3]
    across = math.atan2(0.1, found.speed)  # x_B is to the right of who looks up the slope, so left of who comes down
    assert np.angle(np.exp(1j * (yaw[1] - (math.pi + 0.02)))) == pytest.approx(across, abs=0.02)


def test_walls_turn_it_back():
    estimator = slope(restitution=0.5)
    stamps = PERIOD * np.arange(6)
    points = free(stamps, x=0.05, vx=0.5)
    state = watch(estimator, stamps, points)[-1]
    at_wall = (0.5 * WIDTH - RADIUS - 0.05) / 0.5
    times = np.array([at_wall - 0.05, at_wall + 0.2])
    x = to_board(estimator.predict(state, times))[:, 0]
    assert x[0] == pytest.approx(0.28 - 0.025, abs=0.003)
    assert x[1] == pytest.approx(0.28 - 0.5 * 0.5 * 0.2, abs=0.003)
    open_board = slope(walls=False)
    later = open_board.predict(watch(open_board, stamps, points)[-1], times)
    assert to_board(later)[1, 0] == pytest.approx(0.28 + 0.1, abs=0.003)


def test_deviations_are_carried_through_a_bounce():
    estimator = slope(restitution=0.5)
    mean, P = np.array([0.2, 0.6, 0.4, -0.3]), np.diag([1e-4, 1e-4, 1e-2, 1e-2])
    rng = np.random.default_rng(0)
    many = mean + rng.multivariate_normal(np.zeros(4), 1e-4 * P, 4000)  # small: as a derivative
    later = np.array([estimator.ball.propagate(m, P, 0.4)[0] for m in many])
    _, spread = estimator.ball.propagate(mean, 1e-4 * P, 0.4)
    noise = estimator.ball.propagate(mean, np.zeros((4, 4)), 0.4)[1]
    np.testing.assert_allclose(np.diag(spread - noise), np.var(later, axis=0), rtol=0.1)


def test_nothing_is_foreseen_of_a_ball_at_rest():
    estimator = slope()
    rng = np.random.default_rng(0)
    stamps = PERIOD * np.arange(60)
    points = np.array([0.1, 0.84]) + 0.0025 * rng.standard_normal((60, 2))
    states = watch(estimator, stamps, points)
    assert not any(estimator.ready(state) for state in states)
    assert all(estimator.exit(state) is None for state in states)
    rows = to_board(estimator.predict(states[-1], stamps[-1] + np.array([0.0, 1.0])))
    np.testing.assert_allclose(rows, [[0.1, 0.84, RADIUS]] * 2, atol=0.002)


def test_after_the_release_it_is_ready_at_once():
    estimator = slope()
    stamps = PERIOD * np.arange(40)
    points = free(np.maximum(stamps - 1.0, 0.0)) + 0.001 * np.random.default_rng(0).standard_normal((40, 2))
    ready = [estimator.ready(state) for state in watch(estimator, stamps, points)]
    assert not any(ready[:15])
    assert all(ready[19:])  # 0.27 s after the release, 36 mm down


def test_a_hit_is_followed_within_three_points():
    estimator = slope()
    stamps = PERIOD * np.arange(12)
    before, after = free(stamps[:7]), free(stamps[7:] - stamps[6] - 0.03, *free([stamps[6] + 0.03])[0], -0.35, -0.05)
    states = watch(estimator, stamps, np.vstack([before, after]))
    ahead = stamps[-1] + 0.2 - stamps[6] - 0.03
    truth = free([ahead], *free([stamps[6] + 0.03])[0], -0.35, -0.05)[0]
    errors = [
        np.hypot(*(to_board(estimator.predict(state, [stamps[-1] + 0.2]))[0, :2] - truth)) for state in states[6:10]
    ]
    assert errors[0] > 0.15 and errors[3] < 0.012
    std = [estimator.predict_std(state, [state.stamp])[0] for state in states]
    assert std[7] > std[6]


def test_a_jammed_ball_has_no_exit_and_rolls_on_later():
    estimator = slope()
    stamps = PERIOD * np.arange(36)
    stopped = free([stamps[8]])[0]
    points = np.vstack([free(stamps[:9]), [stopped] * 15, free(stamps[24:] - stamps[23], *stopped)])
    states = watch(estimator, stamps, points)
    assert estimator.exit(states[8]) is not None
    assert estimator.exit(states[22]) is None and not estimator.ready(states[22])
    last = estimator.exit(states[-1])
    assert last.time == pytest.approx(stamps[23] + math.sqrt(2 * stopped[1] / ACCELERATION), abs=0.01)


def test_points_that_cannot_be_are_left_out():
    estimator = slope()
    stamps = PERIOD * np.arange(10)
    state = watch(estimator, stamps, free(stamps))[-1]
    here = state.mean[:2]
    later = stamps[-1] + PERIOD
    off_board = to_world([[0.45, 0.5]], X_WB)[0]
    for stamp, p_WQ in (
        (later, None),
        (later, [np.nan, 0.0, 0.5]),
        (later, [np.inf, 0.0, 0.5]),
        (np.nan, to_world([here], X_WB)[0]),
        (stamps[-1], to_world([here], X_WB)[0]),
        (stamps[3], to_world([here], X_WB)[0]),
        (later, off_board),
    ):
        assert estimator.update(state, stamp, p_WQ) is state
    far = to_world([[-0.25, here[1]]], X_WB)[0]
    once = estimator.update(state, later, far)
    assert once.rejected == 1 and np.array_equal(once.mean, state.mean)
    good = estimator.update(once, later + PERIOD, to_world(free([later + PERIOD]), X_WB)[0])
    assert estimator.exit(good).x == pytest.approx(0.1, abs=0.005)
    twice = estimator.update(once, later + PERIOD, far)  # it is there after all
    assert not estimator.ready(twice)
    np.testing.assert_allclose(twice.mean[:2], [-0.25, here[1]], atol=1e-9)


def test_a_gap_starts_it_afresh():
    estimator = slope()
    stamps = PERIOD * np.arange(6)
    state = watch(estimator, stamps, free(stamps))[-1]
    state = estimator.update(state, stamps[-1] + 1.0, to_world([[0.0, 0.3]], X_WB)[0])
    assert not estimator.ready(state) and estimator.exit(state) is None


def test_before_any_point_it_says_nothing_and_never_nan():
    estimator = slope()
    state = estimator.initial_state()
    assert not estimator.ready(state) and estimator.exit(state) is None
    assert np.all(np.isfinite(estimator.predict(state, [0.0, 1.0])))
    assert np.all(np.isfinite(estimator.predict_std(state, [0.0, 1.0])))
    rng = np.random.default_rng(0)
    stamp = 0.0
    for _ in range(400):  # points anywhere, at any time
        stamp += rng.choice([0.001, 0.02, 0.07, 0.6])
        state = estimator.update(state, stamp, to_world(rng.uniform([-0.3, -0.02], [0.3, 0.9], (1, 2)), X_WB)[0])
        found = estimator.exit(state)
        assert found is None or np.all(np.isfinite([found.time, *found.p_WQ, found.std_x, found.std_time]))
        times = state.stamp + np.array([0.0, 1.5])
        assert np.all(np.isfinite(estimator.predict(state, times)))
        assert np.all(np.isfinite(estimator.predict_std(state, times)))


def test_an_update_leaves_the_old_state_as_it_was():
    estimator = slope()
    stamps = PERIOD * np.arange(4)
    old = watch(estimator, stamps, free(stamps))[-1]
    copy = np.array(old.mean)
    estimator.update(old, stamps[-1] + PERIOD, to_world(free([stamps[-1] + PERIOD]), X_WB)[0])
    np.testing.assert_array_equal(old.mean, copy)
    with pytest.raises(ValueError):
        old.mean[0] = 1.0


def test_the_board_may_be_given_as_twelve_numbers():
    stamps = PERIOD * np.arange(6)
    one, other = slope(), make_estimator("inclined_plane", X_WB=X_WB[:3].ravel().tolist(), length=LENGTH)
    a, b = (estimator.exit(watch(estimator, stamps, free(stamps))[-1]) for estimator in (one, other))
    assert a.time == b.time and a.x == b.x


@pytest.mark.parametrize(
    "wrong",
    [
        {"X_WB": np.eye(4)},
        {"X_WB": [1.0, 2.0]},
        {"X_WB": np.full((4, 4), np.nan)},
        {"width": -1.0},
        {"width": 0.03},
        {"sigma": 0.0},
        {"process_noise": np.nan},
        {"restitution": 1.5},
        {"colour": "white"},
    ],
)
def test_wrong_settings_are_one_line(wrong):
    with pytest.raises(DrakeTrackerError, match="inclined_plane") as caught:
        make_estimator("inclined_plane", **{"X_WB": X_WB, **wrong})
    assert "\n" not in str(caught.value)
