import math

import numpy as np
import pytest
from catches import X_WB, ball_packet, edge, on_edge

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import KNOT_COUNT, Prediction, message_size
from drake_tracker.grasp.ball.board_exit import BoardEdge

OUTWARD = np.array([-math.cos(0.02), -math.sin(0.02), 0.0])


@pytest.mark.parametrize("speed", [0.65, 1.3])
@pytest.mark.parametrize("x, vx", [(0.0, 0.0), (0.12, -0.3), (-0.2, 0.2)])
@pytest.mark.parametrize("arrival", [2.31, 2.345, 3.4])
def test_it_finds_time_and_place_of_the_crossing(speed, x, vx, arrival):
    found = edge().crossing(ball_packet(2.0, arrival, x, vx, speed))
    assert found.time == pytest.approx(arrival, abs=0.001)
    np.testing.assert_allclose(found.p_WQ, on_edge(x), atol=0.0007)
    assert found.std == pytest.approx(0.004)


def test_the_cup_stands_where_the_ball_will_be_and_not_where_it_leaves_the_board():
    found = edge(beyond=0.06).crossing(ball_packet(2.0, 2.5, 0.1, vx=-0.5, speed=1.0))
    expected = on_edge(0.1 - 0.5 * 0.06) + 0.06 * OUTWARD
    np.testing.assert_allclose(found.place[:3], expected, atol=0.001)
    assert found.place[3] == pytest.approx(math.pi + 0.02)
    assert edge().home[2] == pytest.approx(found.place[2])


def test_home_is_beyond_the_middle_of_the_edge():
    np.testing.assert_allclose(edge().home[:3], on_edge(0.0) + 0.05 * OUTWARD, atol=1e-9)
    assert edge(hand_yaw=0.0).home[3] == pytest.approx(0.02)


def test_no_place_is_beside_the_board():
    found = edge().crossing(ball_packet(2.0, 2.3, 0.27, vx=0.9, speed=0.7))
    np.testing.assert_allclose(found.place[:3], on_edge(0.28) + 0.05 * OUTWARD, atol=1e-6)


def test_a_path_without_a_crossing_gives_none():
    one = edge()
    assert one.crossing(np.zeros(message_size(Prediction))) is None
    assert one.crossing(ball_packet(2.0, 3.6, 0.0, speed=0.3)) is None  # beyond the last knot
    assert one.crossing(ball_packet(2.0, 1.9, 0.0)) is None  # it is gone
    broken = ball_packet(2.0, 2.5, 0.0)
    broken[20] = np.nan
    assert one.crossing(broken) is None
    resting = ball_packet(2.0, 2.5, 0.0)
    resting[5:] = np.tile(resting[5:10], KNOT_COUNT)
    assert one.crossing(resting) is None


def test_a_board_that_does_not_rise_is_refused():
    for wrong in (np.eye(4), np.zeros(5), np.full(12, np.inf)):
        with pytest.raises(DrakeTrackerError, match="board edge"):
            BoardEdge(wrong)
    np.testing.assert_array_equal(BoardEdge(X_WB[:3].ravel()).home, BoardEdge(X_WB).home)
