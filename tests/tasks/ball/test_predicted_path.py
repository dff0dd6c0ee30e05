"""Tests of the points that are drawn for a packet on the inclined board."""

import numpy as np
import pytest
from catches import ball_packet, edge, on_edge

from drake_tracker.core.messages import predicted_points
from drake_tracker.tasks.ball.filming import BAR, INTO_CUP, WITHOUT_CROSSING, PredictedPath

NOW, ARRIVAL = 1.0, 1.6


@pytest.fixture
def predicted():
    return PredictedPath(edge())


def test_the_path_ends_in_the_cup(predicted):
    packet = ball_packet(NOW - 0.1, ARRIVAL, 0.12)
    path = predicted.path(packet, NOW, 9)
    assert path.shape == (9, 3)
    np.testing.assert_allclose(path[[0, -1]], predicted_points(packet, [NOW, ARRIVAL + INTO_CUP]), atol=1e-3)


def test_nothing_is_drawn_once_the_ball_is_in_the_cup(predicted):
    packet = ball_packet(NOW - 0.1, ARRIVAL, 0.12)
    late = ARRIVAL + INTO_CUP + 0.01
    assert len(predicted.path(packet, late, 9)) == len(predicted.goal(packet, late)) == 0


def test_a_path_that_does_not_reach_the_edge_has_a_fixed_duration(predicted):
    packet = ball_packet(NOW, NOW + 9.0, 0.0, speed=0.2)
    assert len(predicted.goal(packet, NOW)) == 0
    path = predicted.path(packet, NOW, 5)
    np.testing.assert_allclose(path[-1], predicted_points(packet, [NOW + WITHOUT_CROSSING])[0], atol=1e-9)


def test_the_goal_lies_on_the_edge_with_a_bar_of_two_standard_deviations(predicted):
    at, left, right = predicted.goal(ball_packet(NOW - 0.1, ARRIVAL, 0.12), NOW)
    np.testing.assert_allclose(at, on_edge(0.12), atol=2e-3)
    np.testing.assert_allclose(0.5 * (left + right), at, atol=1e-12)
    assert np.linalg.norm(right - left) == pytest.approx(2 * BAR * 0.004)
