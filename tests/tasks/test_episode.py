"""Tests of what a log says about a run."""

import numpy as np
import pytest

from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import during, fresh_packets, predictions_ahead, predictions_of_now, tool_pose
from drake_tracker.tasks.train.episode import errors, phase_spans, sighted, train_pose


def test_phases_start_when_they_were_commanded(episode, grasp_phases, known):
    episode.phases = grasp_phases
    spans = phase_spans(episode.log())
    assert [span.phase for span in spans] == [phase for phase, _ in grasp_phases]
    assert spans[0].start == 0.0
    for span, (_, shown) in zip(spans[1:], grasp_phases[1:]):
        assert span.start == pytest.approx(known.tick(shown), abs=1e-9)
    assert all(a.end == b.start for a, b in zip(spans, spans[1:]))
    assert spans[-1].end == pytest.approx(6.0)


def test_vision_is_not_used_after_the_descent_begins(episode, grasp_phases):
    episode.phases = grasp_phases
    spans = phase_spans(episode.log())
    times = np.array([0.5, 2.0, 3.1, 3.4, 4.0, 5.0])
    assert sighted(spans, times).tolist() == [True, True, False, False, False, False]
    assert during(spans, times, Phase.CLOSE).tolist() == [False, False, False, True, False, False]


def test_the_true_pose_between_and_beyond_samples(episode, known):
    pose = train_pose(episode.log(), [1.2345, 99.0])
    expected = [episode.x, episode.y + known.SPEED * 1.2345, known.TRAIN_Z, np.pi / 2]
    np.testing.assert_allclose(pose[0], expected, atol=1e-9)
    assert np.isnan(pose[1]).all()


def test_the_true_yaw_is_continuous_and_independent_of_the_quaternions_length(episode):
    log = episode.log()
    truth = log["truth_train_state"]
    turned = np.linspace(0.0, 4 * np.pi, len(truth.times))
    truth.data[:, 0], truth.data[:, 3] = 1.01 * np.cos(turned / 2), 1.01 * np.sin(turned / 2)
    np.testing.assert_allclose(train_pose(log, truth.times)[:, 3], turned, atol=1e-9)


def test_errors_are_positive_ahead_and_to_the_left(episode):
    log = episode.log()
    (x, y) = episode.place(np.array([2.0]))[0]
    # The train runs along +y: 5 mm ahead is +y, 3 mm to its left is -x.
    np.testing.assert_allclose(errors(log, [2.0], [(x - 0.003, y + 0.005)]), [[0.005, 0.003]], atol=1e-12)


def test_predictions_are_evaluated_at_their_horizon(episode):
    episode.beside = lambda t: 0.001 * t
    log = episode.log()
    prediction = log["prediction"]
    ahead = predictions_ahead(prediction, 0.75)
    np.testing.assert_allclose(ahead.times, ahead.stamps + 0.75)
    np.testing.assert_allclose(ahead.xy, episode.predicted(ahead.times)[:, :2], atol=1e-12)
    now = predictions_of_now(prediction)
    np.testing.assert_allclose(now.xy, episode.predicted(now.times)[:, :2], atol=1e-12)
    assert np.all(now.times - now.stamps > 0.25)


def test_a_packet_counts_once_even_if_it_is_logged_repeatedly(episode):
    log = episode.log()
    prediction = log["prediction"]
    first = fresh_packets(prediction)
    prediction.data[60:70] = prediction.data[60]
    assert len(fresh_packets(prediction)) == len(first) - 9


def test_an_empty_log(nothing):
    assert phase_spans(nothing) == ()
    assert np.isnan(train_pose(nothing, [0.0])).all()
    assert np.isnan(tool_pose(nothing, [0.0])).all()
    assert len(predictions_ahead(nothing["prediction"], 0.25).times) == 0
