import numpy as np
import pytest
from drives import PERIOD, Drive, errors, rms, stadium

from drake_tracker.estimation import make_estimator


def test_constant_acceleration_is_predicted_exactly_with_the_direction_of_its_velocity():
    estimator = make_estimator("alpha_beta_gamma")
    state = estimator.initial_state()

    def truth(t):
        return np.array([0.3 * t, 0.1 * t * t, 0.485])

    for t in PERIOD * np.arange(90):
        state = estimator.update(state, t, truth(t))
    assert estimator.ready(state)
    row = estimator.predict(state, [2.0])[0]
    np.testing.assert_allclose(row[:3], truth(2.0), atol=1e-8)
    assert np.isclose(row[3], np.arctan2(0.4, 0.3))


def test_yaw_is_continuous_and_held_where_the_velocity_vanishes():
    estimator = make_estimator("alpha_beta_gamma")
    state = estimator.initial_state()
    for t in PERIOD * np.arange(90):  # heads in -x and slows down, with y noise about the branch cut of atan2
        state = estimator.update(state, t, np.array([-0.3 * t + 0.05 * t * t, 1e-6 * np.sin(50 * t), 0.485]))
    rows = estimator.predict(state, state.stamp + np.linspace(0.0, 1.5, 31))
    assert np.all(np.abs(np.diff(rows[:, 3])) < 0.1)
    np.testing.assert_allclose(np.abs(rows[:, 3]), np.pi, atol=0.05)


def test_a_gap_restarts_and_old_points_are_ignored():
    estimator = make_estimator("alpha_beta_gamma")
    state = estimator.initial_state()
    for t in PERIOD * np.arange(90):
        state = estimator.update(state, t, np.array([0.2 * t, 0.0, 0.5]))
    assert estimator.update(state, 0.5, np.array([9.0, 9.0, 9.0])) is state
    after = estimator.update(state, 9.0, np.array([0.1, 0.2, 0.5]))
    assert not estimator.ready(after)
    np.testing.assert_allclose(estimator.predict(after, [9.5])[0], [0.1, 0.2, 0.5, 0.0], atol=1e-5)


@pytest.mark.parametrize("every", [2, 4])
def test_at_fewer_points_a_second_the_index_goes_with_the_period(every):
    drive = Drive(stadium(), 0.15, 30.0)
    _, whole = errors(make_estimator("alpha_beta_gamma"), drive.times, drive.points, drive, 0.25)
    times, points = drive.times[::every], drive.points[::every]
    _, fewer = errors(make_estimator("alpha_beta_gamma", period=every * PERIOD), times, points, drive, 0.25)
    assert rms(fewer[60:, 1]) < 1.5 * rms(whole[60:, 1])


def test_two_points_at_next_to_the_same_time_are_no_speed():
    drive = Drive(stadium(), 0.15, 4.0)
    estimator = make_estimator("alpha_beta_gamma")
    state, _ = errors(estimator, drive.times, drive.points, drive, 0.25)
    again = estimator.update(state, state.stamp + 1e-6, drive.points[-1] + [0.0005, 0.0, 0.0])
    before, after = (estimator.predict(each, [state.stamp + 0.25])[0, :3] for each in (state, again))
    np.testing.assert_allclose(after, before, atol=0.002)
