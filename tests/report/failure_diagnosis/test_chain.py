"""The chain of differences."""

import numpy as np
import pytest

from drake_tracker.core.messages import KNOT_COUNT, pack_prediction
from drake_tracker.report.failure_diagnosis.chain import Packets, chain, in_train
from drake_tracker.report.failure_diagnosis.stages import Stage


def packet(rng, stamp=1.0):
    knots = np.cumsum(rng.normal(0.0, 0.02, (KNOT_COUNT, 5)), axis=0)
    return pack_prediction(stamp, 1, knots)


@pytest.mark.parametrize("ready", [True, False])
def test_the_rows_add_up_for_any_packets(ready):
    rng = np.random.default_rng(3)
    yardsticks = [packet(rng) if ready else None for _ in range(3)]
    train, hand = rng.normal(0.0, 0.3, (2, 4))
    rows = chain(Packets(*yardsticks, packet(rng), packet(rng, 0.7)), 1.83, train, hand)
    whole = rows.sum(axis=0)
    assert whole[:3] == pytest.approx((hand - train)[:3], abs=1e-12)
    turn = (whole[3] - (hand - train)[3]) / np.pi
    assert turn == pytest.approx(round(turn), abs=1e-12)
    assert not rows[Stage.TIMING].any()
    assert rows[Stage.VISION].any() == ready


def test_an_error_in_the_filtered_yaw_grows_along_the_path():
    """An error of 10 deg in yaw at the stamp is one of 10 deg, and of position, at the end of a path of 0.1 m."""
    straight = np.zeros((KNOT_COUNT, 5))
    straight[:, 0] = 0.005 * np.arange(KNOT_COUNT)  # 0.1 m/s along x
    turn = np.deg2rad(10.0)
    turned = np.array(straight)
    turned[:, 0], turned[:, 1], turned[:, 3] = np.cos(turn) * straight[:, 0], np.sin(turn) * straight[:, 0], turn
    good, bad = pack_prediction(0.0, 1, straight), pack_prediction(0.0, 1, turned)
    train = np.array([0.1, 0.0, 0.0, 0.0])
    rows = chain(Packets(good, good, good, bad, bad), 1.0, train, [*turned[20, :3], turn])
    assert rows[Stage.FILTER] == pytest.approx([0.1 * np.cos(turn) - 0.1, 0.1 * np.sin(turn), 0.0, turn])
    assert np.delete(rows, Stage.FILTER, axis=0) == pytest.approx(0.0, abs=1e-12)


def test_along_and_across_are_those_of_the_train():
    found = in_train(np.array([[0.0, 0.2, 0.3, 0.4]]), np.pi / 2)
    assert found[0] == pytest.approx([0.2, 0.0, 0.3, 0.4])
