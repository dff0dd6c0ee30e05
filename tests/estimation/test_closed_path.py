import numpy as np
import pytest
from drives import PERIOD, Drive, errors, rms, stadium

from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.parts import TurnFilter
from drake_tracker.world.train.tracks import make_track

SPEED = 0.2


def closed_path():
    """Returns the estimator without an allowance for systematic errors, which the points here do not have."""
    return make_estimator("closed_path", systematic_std=0.0)


def run(drive, horizon=0.75, points=None):
    points = drive.points if points is None else points
    return errors(closed_path(), drive.times, points, drive, horizon)


def laps(drive, rows, first, last):
    lap = rows[:, 0] / drive.lap_time(SPEED)
    return rows[(lap >= first) & (lap < last)]


@pytest.mark.parametrize("kind", ["stadium", "oval", "circle", "figure_eight"])
def test_a_closed_path_is_predicted_accurately(kind):
    track = stadium() if kind == "stadium" else make_track(kind)
    drive = Drive(track, SPEED, 2.2 * track.length / SPEED)
    state, rows = run(drive)
    assert state.path.length == pytest.approx(track.length, rel=0.01)
    after = laps(drive, rows, 1.2, 2.2)
    assert rms(after[:, 1]) < 0.001
    assert rms(after[:, 2]) < np.radians(1.0)


def test_before_closure_it_predicts_as_a_coordinated_turn_filter():
    drive = Drive(stadium(), SPEED, 5.0)
    _, rows = run(drive)
    _, plain = errors(TurnFilter(), drive.times, drive.points, drive, 0.75)
    np.testing.assert_array_equal(rows, plain)


def test_the_crossing_of_a_figure_eight_is_no_closure():
    track = make_track("figure_eight")
    drive = Drive(track, SPEED, 0.95 * track.length / SPEED)
    state, _ = run(drive)
    assert state.path is None


def test_an_open_path_does_not_close():
    drive = Drive(make_track("line", length=2.0), 0.15, 10.0)
    state, _ = run(drive)
    assert state.path is None


def test_68_percent_of_the_errors_lie_within_predict_std():
    drive = Drive(stadium(), SPEED, 30.0)
    _, rows = run(drive)
    after = laps(drive, rows, 1.2, 9.0)
    assert 0.5 < np.mean(after[:, 1] < after[:, 3]) < 0.85


def test_it_follows_a_changing_speed_and_beats_the_coordinated_turn():
    drive = Drive(stadium(), lambda t: SPEED * (1.0 + 0.15 * np.sin(2 * np.pi * t / 4.0)), 26.0)
    _, rows = run(drive)
    _, plain = errors(make_estimator("coordinated_turn"), drive.times, drive.points, drive, 0.75)
    assert rms(laps(drive, rows, 1.2, 3.0)[:, 1]) < 0.65 * rms(laps(drive, plain, 1.2, 3.0)[:, 1])


def test_stop_and_go_and_backing_up_leave_it_on_its_path():
    def speed(t):
        if 10.0 < t < 12.0:
            return 0.0
        return -SPEED if 14.0 < t < 16.0 else SPEED

    drive = Drive(stadium(), speed, 22.0)
    state, rows = run(drive)
    assert state.following is not None
    assert rms(rows[rows[:, 0] > 20.0, 1]) < 0.004


def test_the_path_survives_seconds_without_vision():
    drive = Drive(stadium(), SPEED, 18.0)
    points = list(drive.points)
    blind = slice(round(10.0 / PERIOD), round(13.0 / PERIOD))
    points[blind] = [None] * len(points[blind])
    state, rows = run(drive, points=points)
    assert state.following is not None
    during = rows[(rows[:, 0] > 10.0) & (rows[:, 0] < 13.0)]
    assert during[:, 1].max() < 0.003  # it predicts where the object goes, supposing that it keeps moving
    assert during[-1, 3] > during[0, 3]  # with growing uncertainty
    assert rms(rows[rows[:, 0] > 13.5, 1]) < 0.001


def test_after_a_moved_track_it_learns_again():
    drive = Drive(stadium(), SPEED, 3.7 * stadium().length / SPEED)
    moved = drive.times > 2.0 * drive.lap_time(SPEED)
    points = drive.points + np.where(moved, 1.0, 0.0)[:, None] * [0.06, 0.02, 0.0]
    state, _ = run(drive, points=points)
    assert state.path is not None
    x, y = closed_path().predict(state, [drive.times[-1] + 0.75])[0, :2]
    truth = drive.truth([drive.times[-1] + 0.75])[0, :2] + [0.06, 0.02]
    assert np.hypot(x - truth[0], y - truth[1]) < 0.002


def test_a_track_moved_so_that_it_crosses_itself_is_left_at_once():
    """Shifted and turned: the points lie on the old path again for a moment."""
    track, speed = stadium(), 0.15
    drive = Drive(track, speed, 4.0 * track.length / speed)
    cos, sin, middle = np.cos(0.4), np.sin(0.4), track.points.mean(axis=0)
    points = np.array(drive.points)
    moved = drive.times > 2.25 * drive.lap_time(speed)
    points[moved, :2] = middle + [0.04, -0.03] + (points[moved, :2] - middle) @ np.array([[cos, sin], [-sin, cos]])
    estimator = closed_path()
    state, known = estimator.initial_state(), []
    for t, p in zip(drive.times, points, strict=True):
        state = estimator.update(state, t, p)
        known.append(state.path is not None)
    laps = (drive.times - drive.times[np.argmax(moved)]) / drive.lap_time(speed)
    known = np.array(known)
    assert not known[(laps > 0.2) & (laps < 0.9)].any()
    assert known[laps > 1.2].all()


def test_correlated_noise_is_not_a_change_of_speed():
    drive = Drive(stadium(), SPEED, 24.0, sigma=0.0)
    white = np.random.default_rng(5).standard_normal((len(drive.times), 3))
    noise = np.zeros_like(white)
    for k in range(1, len(noise)):
        noise[k] = 0.9 * noise[k - 1] + np.sqrt(1.0 - 0.81) * white[k]
    _, rows = run(drive, points=drive.points + 0.001 * noise)
    assert rms(laps(drive, rows, 1.3, 3.0)[:, 1]) < 0.004


def test_a_few_outliers_do_not_lose_the_path():
    drive = Drive(stadium(), SPEED, 18.0)
    points = np.array(drive.points)
    for first, count, off in ((900, 1, 0.05), (950, 2, 0.02), (1000, 3, 0.01)):
        points[first : first + count] += [off, -off, 0.0]
    state, rows = run(drive, points=points)
    assert state.following is not None
    late = rows[rows[:, 0] > 14.8]
    assert rms(late[:, 1]) < 0.0015


def test_outliers_along_the_path_are_not_a_change_of_speed():
    drive = Drive(stadium(), SPEED, 18.5)
    points = np.array(drive.points)
    points[1000:1003] += [0.01, -0.01, 0.0]
    _, rows = run(drive, points=points)
    assert rows[rows[:, 0] > 16.0][:, 1].max() < 0.002


def test_an_object_moved_2_cm_along_its_path_is_followed_from_there():
    drive = Drive(stadium(), lambda t: SPEED + 1.2 * (16.0 <= t < 16.0 + PERIOD), 18.5)
    state, rows = run(drive)
    assert state.following is not None and state.following.outliers == 0
    assert rms(rows[rows[:, 0] > 17.5][:, 1]) < 0.003


def test_outliers_are_not_learned():
    drive = Drive(stadium(), SPEED, 1.8 * stadium().length / SPEED)
    rng = np.random.default_rng(1)
    outliers = rng.random(len(drive.times)) < 0.02
    points = drive.points.copy()
    points[outliers, :2] += 0.05 * rng.choice([-1.0, 1.0], (outliers.sum(), 2))
    _, rows = run(drive, points=points)
    after = laps(drive, rows, 1.2, 1.8)
    assert np.percentile(after[:, 1], 90) < 0.0015  # 4 mm if they were learned with the path


def test_a_short_bias_does_not_lose_the_path():
    drive = Drive(stadium(), SPEED, 16.0, sigma=0.0003)
    points = np.array(drive.points)
    points[840:855] += [-0.0017, 0.0017, 0.0]
    state, rows = run(drive, points=points)
    assert state.following is not None
    assert rms(rows[rows[:, 0] > 13.5, 1]) < 0.002


@pytest.mark.parametrize("lag_cycles", [2, 30])
def test_the_lag_does_not_matter(lag_cycles):
    """Nothing depends on the time of an update: points that arrive late and in bursts give the same result."""
    drive = Drive(stadium(), SPEED, 10.0)
    estimator = closed_path()
    state = estimator.initial_state()
    for k in range(0, len(drive.times), lag_cycles):
        for t, p in zip(drive.times[k : k + lag_cycles], drive.points[k : k + lag_cycles], strict=True):
            state = estimator.update(state, t, p)
    plain, _ = run(drive)
    np.testing.assert_array_equal(estimator.predict(state, [11.0]), estimator.predict(plain, [11.0]))


@pytest.mark.parametrize("gap", [8.0, 30.0, 150.0, 1e5])
def test_a_long_time_without_vision_does_no_harm(gap):
    drive = Drive(make_track("circle", radius=0.16), SPEED, 8.0)
    estimator = closed_path()
    state = estimator.initial_state()
    for t, p in zip(drive.times, drive.points, strict=True):
        state = estimator.update(state, t, p)
    lap_time = drive.lap_time(SPEED)
    laps = np.ceil((drive.times[-1] + gap) / lap_time)
    for t, p in zip(drive.times, drive.points, strict=True):  # the same again, whole laps later
        state = estimator.update(state, laps * lap_time + t, p)
        assert state.stamp == laps * lap_time + t
        later = estimator.predict(state, state.stamp + np.array([0.0, 0.75, 8.0, 100.0]))
        assert np.isfinite(later).all()
        assert np.isfinite(estimator.predict_std(state, state.stamp + np.array([0.0, 0.75, 8.0, 100.0]))).all()
    x, y = estimator.predict(state, [state.stamp + 0.75])[0, :2]
    assert np.hypot(*(drive.truth(drive.times[-1:] + 0.75)[0, :2] - [x, y])) < 0.004
    assert state.path.length == pytest.approx(drive.track.length, rel=0.01)


def test_predict_std_grows_steadily_with_the_horizon():
    drive = Drive(stadium(), SPEED, 14.0)
    state, _ = run(drive)
    deviations = closed_path().predict_std(state, state.stamp + np.arange(0.0, 9.0, 0.5))
    assert (np.diff(deviations) > -2e-4).all()
    assert deviations[-1] < 0.1


@pytest.mark.parametrize("seed", range(6))
def test_an_object_that_starts_from_rest_is_learned_in_either_direction(seed):
    """At rest its heading is pure noise, and may be the wrong one."""
    track = make_track("circle", radius=0.16)
    drive = Drive(track, lambda t: SPEED if t > 2.0 else 0.0, 2.0 + 1.4 * track.length / SPEED, seed=seed)
    state, rows = run(drive)
    assert state.path is not None
    assert state.path.length == pytest.approx(track.length, rel=0.02)
    assert abs(rows[-60:, 2]).max() < 0.1


@pytest.mark.parametrize("gap, laps", [(2.0, 0.6), (9.0, 1.2)])
def test_the_path_before_a_gap_is_kept_if_no_lap_can_have_been_completed(gap, laps):
    drive = Drive(stadium(), SPEED, 4.0 + gap + 2.5 * stadium().length / SPEED)
    estimator = closed_path()
    state, closed_at = estimator.initial_state(), None
    for t, p in zip(drive.times, drive.points, strict=True):
        if not 4.0 < t < 4.0 + gap:
            state = estimator.update(state, t, p)
        if closed_at is None and state.path is not None:
            closed_at = t
    assert closed_at < 4.0 + gap + laps * drive.lap_time(SPEED)
    assert state.path.length == pytest.approx(stadium().length, rel=0.02)
