from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.core.messages import TrackState
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.track_3d import Measurement, new_track

PERIOD = 1 / 60
STD = 0.003
SHAPE = ObjectShape(np.array([0.1, 0.04, 0.05]), 0.0, np.eye(3), np.zeros(3))


def measured(p_WQ, std=STD):
    return Measurement(np.asarray(p_WQ, float), std**2 * np.eye(3), 0.001, 1.0)


def begun(p_WQ=(0.5, 0.1, 0.48), stamp=2.0):
    return new_track(stamp, measured(p_WQ), SHAPE, (200.0, 170.0, 60.0))


def follow(path, count, std=0.0, seed=0):
    """The track after ``count`` measurements of a path, a function of the time [s] after the first one."""
    rng = np.random.default_rng(seed)
    track = begun(path(0.0))
    for k in range(1, count):
        track = track.predicted(2.0 + k * PERIOD).updated(measured(path(k * PERIOD) + rng.normal(0.0, std, 3)))
    return track


def line(time):
    return np.array([0.5, 0.1, 0.48]) + time * np.array([0.1, -0.12, 0.0])


def test_a_new_track_stands_at_its_measurement_without_a_number():
    track = begun()
    assert track.number == 0 and track.hits == 1 and track.misses == 0
    assert (track.stamp, track.seen) == (2.0, 2.0)
    np.testing.assert_array_equal(track.position, [0.5, 0.1, 0.48])
    assert track.speed == 0.0 and track.height == 0.48
    np.testing.assert_array_equal(track.covariance[:3, :3], STD**2 * np.eye(3))
    assert (np.diag(track.covariance)[3:] > 0.0).all()


def test_the_velocity_of_a_straight_path_is_learned():
    track = follow(line, 60, std=0.001)
    np.testing.assert_allclose(track.mean[3:], [0.1, -0.12, 0.0], atol=0.03)
    np.testing.assert_allclose(track.position, line(59 * PERIOD), atol=0.002)
    assert track.speed == pytest.approx(np.hypot(0.1, 0.12), abs=0.03)
    assert track.hits == 60 and track.seen == track.stamp == pytest.approx(2.0 + 59 * PERIOD)


def test_the_track_is_predicted_along_its_velocity():
    track = follow(line, 60)
    later = track.predicted(track.stamp + 0.2)
    np.testing.assert_allclose(later.position, line(59 * PERIOD + 0.2), atol=0.003)
    assert later.seen == track.seen and later.measurement is None and later.places == (-1, -1)
    assert np.trace(later.covariance[:3, :3]) > np.trace(track.covariance[:3, :3])


def test_two_short_predictions_are_one_long_one():
    track = follow(line, 30)
    twice = track.predicted(track.stamp + 0.1).predicted(track.stamp + 0.3)
    once = track.predicted(track.stamp + 0.3)
    np.testing.assert_allclose(twice.mean, once.mean, atol=1e-12)
    np.testing.assert_allclose(twice.covariance, once.covariance, atol=1e-12)


def test_an_object_that_stands_is_expected_where_it_stands():
    track = replace(follow(line, 30), state=TrackState.STANDING)
    later = track.predicted(track.stamp + 1.0)
    np.testing.assert_allclose(later.position, track.position)
    assert np.trace(later.covariance) > np.trace(track.covariance), "it may start"


def test_covariances_stay_symmetric_and_positive():
    track = follow(line, 20)
    for k in range(200):
        track = track.predicted(track.stamp + PERIOD)
        if k % 7:
            track = track.updated(measured(track.position, std=[STD, 1e-5, 0.1][k % 3]))
        np.testing.assert_allclose(track.covariance, track.covariance.T, atol=1e-15)
        assert np.linalg.eigvalsh(track.covariance).min() > 0.0


def test_a_more_certain_measurement_pulls_more():
    track = follow(line, 30).predicted(2.0 + 30 * PERIOD)
    aside = track.position + [0.01, 0.0, 0.0]
    moves = [(track.updated(measured(aside, std)).position - track.position)[0] for std in (0.0005, 0.003, 0.03)]
    assert 0.009 < moves[0] <= 0.01 and moves[0] > moves[1] > moves[2] > 0.0


def test_the_distance_of_a_measurement_is_in_standard_deviations():
    track = follow(line, 60).predicted(2.0 + 60 * PERIOD)
    at = track.distance_squared(measured(track.position))
    std = np.sqrt(track.covariance[0, 0] + STD**2)
    aside = track.distance_squared(measured(track.position + [2.0 * std, 0.0, 0.0]))
    assert at == pytest.approx(0.0, abs=1e-12) and aside == pytest.approx(4.0, rel=0.05)


def test_the_estimator_places_a_track():
    track = follow(line, 30)
    placed = track.placed(np.array([0.7, 0.0, 0.48]), 0.004)
    np.testing.assert_array_equal(placed.position, [0.7, 0.0, 0.48])
    np.testing.assert_array_equal(placed.mean[3:], track.mean[3:])
    np.testing.assert_allclose(placed.covariance[:3, :3], 0.004**2 * np.eye(3))
    assert np.linalg.eigvalsh(placed.covariance).min() > 0.0
    assert placed.seen == track.seen and placed.hits == track.hits


def test_a_track_is_given_a_velocity():
    track = begun().with_velocity(np.array([0.1, 0.2, 0.0]), 0.05)
    np.testing.assert_array_equal(track.mean[3:], [0.1, 0.2, 0.0])
    np.testing.assert_allclose(track.covariance[3:, 3:], 0.05**2 * np.eye(3))
    np.testing.assert_array_equal(track.position, begun().position)


def test_misses_end_with_a_measurement():
    track = replace(follow(line, 5), misses=3)
    assert track.predicted(track.stamp + PERIOD).misses == 3
    assert track.updated(measured(track.position)).misses == 0


def test_no_array_of_a_track_can_be_written():
    track = follow(line, 5)
    for other in (track, track.predicted(3.0), track.placed(np.zeros(3), 0.1), track.with_velocity(np.zeros(3), 0.1)):
        assert not other.mean.flags.writeable and not other.covariance.flags.writeable


def test_the_numbers_of_the_states_are_those_of_the_messages():
    assert [state.name for state in TrackState] == [
        *("NONE", "MOVING", "STANDING", "OCCLUDED", "NOT_OBSERVED", "OUT_OF_VIEW", "MERGED"),
    ]
    assert [int(state) for state in TrackState] == list(range(7))


def test_the_height_of_an_object_is_its_mean_on_a_level_path_and_the_predicted_one_on_a_hill():
    track = replace(begun(), height=0.48, heights=(0.478, 0.484))
    assert track.expected_height == 0.48
    hill = replace(follow(lambda time: line(time) + [0.0, 0.0, 0.05 * time], 60), height=0.50, heights=(0.48, 0.52))
    later = hill.predicted(hill.stamp + 0.2)
    assert later.expected_height == later.position[2] == pytest.approx(0.48 + 0.05 * (59 * PERIOD + 0.2), abs=0.003)
    assert begun().as_object_of(hill).expected_height == begun().position[2]
