import bounds
import numpy as np
import pytest

from drake_tracker.estimation.parts.turn_filter import TurnFilter
from drake_tracker.estimation.parts.turn_model import turn_step
from drake_tracker.world.train.tracks import make_track

PERIOD = 1.0 / 60.0
SIGMA = 0.001


def regression_variance(times, query, degree):
    """Of a polynomial fitted to points with noise SIGMA, read at ``query``: the textbook's formula."""
    design, row = np.vander(times, degree + 1), np.vander([query], degree + 1)[0]
    return SIGMA**2 * row @ np.linalg.inv(design.T @ design) @ row


def test_in_a_linear_world_the_recursion_is_the_kalman_filter():
    transition = np.array([[1.0, PERIOD], [0.0, 1.0]])
    noise = np.array([[PERIOD**3 / 3.0, PERIOD**2 / 2.0], [PERIOD**2 / 2.0, PERIOD]])
    measured = np.diag([1.0 / SIGMA**2, 0.0])
    covariance = np.diag([0.01, 0.04])
    information = np.linalg.inv(covariance)
    weight = np.linalg.inv(noise)
    for _ in range(50):
        information = bounds.information_step(
            information, transition.T @ weight @ transition, -transition.T @ weight, weight + measured
        )
        covariance = transition @ covariance @ transition.T + noise
        gain = covariance[:, 0] / (covariance[0, 0] + SIGMA**2)
        covariance = covariance - np.outer(gain, covariance[0])
    np.testing.assert_allclose(np.linalg.inv(information), covariance, rtol=1e-6)


def test_a_world_of_one_trajectory_is_a_kalman_filter_linearised_at_it():
    model = TurnFilter()
    states = [np.array([0.0, 0.0, 0.7, 0.15, 4.0])]
    for _ in range(90):
        states.append(turn_step(states[-1], PERIOD)[0])

    def noise(state):
        return model.propagate(turn_step(state, -PERIOD)[0], np.zeros((5, 5)), PERIOD)[1]

    start = np.diag([1e-6, 1e-6, 0.01, 1e-4, 25.0])
    found = bounds.turn_world_bound(np.array([states]), noise, np.linalg.inv(start), SIGMA, PERIOD, [0, 30])
    covariance = start
    for k in range(90):
        _, jacobian = turn_step(states[k], PERIOD)
        covariance = jacobian @ covariance @ jacobian.T + noise(states[k + 1])
        if k + 1 <= 60:
            gain = covariance[:, :2] @ np.linalg.inv(covariance[:2, :2] + SIGMA**2 * np.eye(2))
            covariance = covariance - gain @ covariance[:2]
        if k + 1 == 60:
            assert found[0] == pytest.approx(np.trace(covariance[:2, :2]), rel=0.01)
    assert found[1] == pytest.approx(np.trace(covariance[:2, :2]), rel=0.01)


@pytest.mark.parametrize("ahead", [0.0, 0.25, 0.75])
def test_a_straight_first_lap_is_a_line_along_and_a_parabola_across(ahead):
    times = PERIOD * np.arange(61)
    found = bounds.first_lap_bound(times, 0.4, 0.15, [], [0.0], SIGMA, np.inf, [1.0], [ahead])
    query = 1.0 + ahead
    expected = regression_variance(times, query, 1) + regression_variance(times, query, 2)
    assert found[0, 0] == pytest.approx(expected, rel=1e-6)


def test_a_change_of_curvature_costs_what_was_known_of_it():
    times = PERIOD * np.arange(121)
    args = (times, 0.0, 0.15)
    even = bounds.first_lap_bound(*args, [], [0.0], SIGMA, 5.0, [2.0], [0.75])
    changed = bounds.first_lap_bound(*args, [1.7], [0.0, 5.0], SIGMA, 5.0, [2.0], [0.75])
    told = bounds.first_lap_bound(*args, [1.7], [0.0, 5.0], SIGMA, 1e-6, [2.0], [0.75])
    assert told[0, 0] < even[0, 0] < changed[0, 0]
    # At the change nothing is known of the new curvature but the prior: it swings the place by v^2 t^2 / 2 of it.
    at_once = bounds.first_lap_bound(*args, [1.999], [0.0, 5.0], SIGMA, 5.0, [2.0], [0.75])
    assert at_once[0, 0] > 0.9 * (5.0 * (0.15 * 0.75) ** 2 / 2.0) ** 2


def _circle(times, length, speed):
    angle = 2.0 * np.pi * speed / length * np.asarray(times)
    return np.column_stack([-np.sin(angle), np.cos(angle)])


def test_on_a_known_path_only_the_rate_is_unknown():
    times, query, length, speed = PERIOD * np.arange(1200), np.array([20.75]), 1.0, 0.1
    found = bounds.closed_path_bound(
        times,
        _circle(times, length, speed),
        query,
        _circle(query, length, speed),
        length,
        speed,
        SIGMA,
        np.full(9, 1e-9),
    )
    # A line through the origin: the phase counts from the first point, which lies where it is known to lie.
    assert found[0] == pytest.approx(SIGMA**2 * query[0] ** 2 / np.sum(times**2), rel=1e-4)


def test_over_many_laps_every_coefficient_costs_its_share():
    length, speed = 1.0, 0.1
    times = PERIOD * np.arange(30 * 600)  # thirty whole laps
    query = times[-1] + np.linspace(0.0, 10.0, 50)
    found = bounds.closed_path_bound(
        times,
        _circle(times, length, speed),
        query,
        _circle(query, length, speed),
        length,
        speed,
        SIGMA,
        np.full(9, 1.0),
    )
    n = len(times)
    coefficients = 2.0 * 9.0 * SIGMA**2 / n
    # The rate's error against the middle of the data, as of any straight line.
    rate = SIGMA**2 * np.mean((query - times.mean()) ** 2) / np.sum((times - times.mean()) ** 2)
    assert np.mean(found) == pytest.approx(coefficients + rate, rel=0.02)


def test_a_circle_has_no_floor_and_a_stadium_that_of_its_four_changes():
    circle = make_track("circle")
    assert np.sqrt(bounds.constant_curvature_floor(circle, 0.15, [0.75])[0]) < 1e-5
    radius, speed, horizon = 0.175, 0.15, 0.75
    track = make_track("stadium", radius=radius, straight=0.25)
    found = bounds.constant_curvature_floor(track, speed, [horizon], samples=4000)[0]
    # The jump of curvature acts for a time t in 0..h, equally likely: mean of (v^2 t^2 / 2R)^2, four times a lap.
    expected = 4.0 * speed * horizon / track.length * (speed**2 / (2.0 * radius)) ** 2 * horizon**4 / 5.0
    assert found == pytest.approx(expected, rel=0.1)


def test_changes_of_curvature_are_found():
    track = make_track("stadium", radius=0.175, straight=0.25)
    changes = bounds.curvature_changes(track)
    gaps = np.sort(np.diff(np.append(changes, changes[0] + track.length)))
    np.testing.assert_allclose(gaps, [0.25, 0.25, np.pi * 0.175, np.pi * 0.175], atol=0.006)
    assert len(bounds.curvature_changes(make_track("circle"))) == 0
