import numpy as np
import pytest

from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, Prediction, message_size, pack_prediction
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.descent import is_wrong
from drake_tracker.grasp.gate import Gate, came_true
from drake_tracker.grasp.prediction_memory import (
    ALONG,
    HEIGHT,
    HEIGHT_LIMIT,
    LATERAL,
    MAX_RECORDS,
    STAMP,
    TURN,
    YAW,
    PredictionMemory,
    X,
    Y,
    recall,
    recent,
    remember,
)

HORIZON, PERIOD = 0.7, 0.03
LAP = 8.0


def oval(t):
    a = 2 * np.pi / LAP * np.asarray(t)
    yaw = np.arctan2(0.22 * np.cos(a), -0.16 * np.sin(a))
    yaw = yaw + 2 * np.pi * np.round((a + np.pi / 2 - yaw) / (2 * np.pi))
    return np.stack(np.broadcast_arrays(0.56 + 0.16 * np.cos(a), 0.22 * np.sin(a), 0.485, yaw), axis=-1)


def figure_eight(t):
    """Crosses itself at (0.56, 0) at t = 0 and LAP / 2, in two directions."""
    a = 2 * np.pi / LAP * np.asarray(t)
    yaw = np.unwrap(np.atleast_1d(np.arctan2(2 * 0.16 * np.cos(2 * a), 0.22 * np.cos(a)))).reshape(np.shape(a))
    return np.stack(np.broadcast_arrays(0.56 + 0.22 * np.sin(a), 0.16 * np.sin(2 * a), 0.485, yaw), axis=-1)


def packet_at(stamp, path, error=None):
    """A packet whose first knot is the truth, and whose prediction is off by error(place's time, age), if given.

    ``error`` returns (lateral, along, turn) at the age of a knot [s].
    """
    times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
    poses = path(times).copy()
    if error is not None:
        for k in range(KNOT_COUNT):
            lateral, along, turn = error(stamp, k * KNOT_SPACING)
            c, s = np.cos(poses[k, 3]), np.sin(poses[k, 3])
            poses[k, :2] += [along * c - lateral * s, along * s + lateral * c]
            poses[k, 3] += turn
    return pack_prediction(stamp, round(stamp / PERIOD), np.column_stack([poses, np.full(KNOT_COUNT, 0.002)]))


def watch(start, stop, path=oval, error=None, memory=None, period=PERIOD, horizon=HORIZON):
    memory = PredictionMemory() if memory is None else memory
    for stamp in np.arange(start, stop, period):
        memory = remember(memory, packet_at(stamp, path, error), horizon)
    return memory


def test_predictions_that_come_true_are_recorded_as_such():
    memory = watch(1.0, 5.0)
    assert len(memory.records) == pytest.approx((4.0 - HORIZON) / PERIOD, abs=2)
    # between knots a packet is a chord: .05 s at .13 m/s on this bend is .1 mm inside
    assert np.max(np.abs(memory.records[:, [LATERAL, ALONG]])) < 3e-4
    assert np.max(np.abs(memory.records[:, TURN])) < 2e-3
    np.testing.assert_allclose(memory.records[:, [X, Y, YAW]], oval(memory.records[:, STAMP])[:, [0, 1, 3]], atol=1e-9)


def test_the_error_is_that_at_the_horizon_signed_across_and_along_the_path():
    def drift(stamp, age):
        return 0.02 * age, -0.05 * age, 0.1 * age

    rows = watch(1.0, 5.0, error=drift).records
    np.testing.assert_allclose(rows[:, LATERAL], 0.02 * HORIZON, atol=1e-3)
    np.testing.assert_allclose(rows[:, ALONG], -0.05 * HORIZON, atol=1e-3)
    np.testing.assert_allclose(rows[:, TURN], 0.1 * HORIZON, atol=1e-3)


def test_what_went_wrong_at_a_place_is_recalled_one_lap_later_at_that_place():
    def wrong_at_the_far_end(stamp, age):
        bad = np.cos(2 * np.pi / LAP * stamp) > 0.7
        return (0.03 * age / HORIZON if bad else 0.0), 0.0, 0.0

    memory = watch(1.0, 1.0 + LAP + 1.5, error=wrong_at_the_far_end)
    for phase, expected in ((0.0, 0.03), (0.5, 0.0), (0.25, 0.0), (0.99, 0.03)):
        now = 1.0 + LAP + 1.5 + (phase - (2.5 / LAP) % 1.0) % 1.0 * LAP
        rows = recall(memory, packet_at(now, oval), 0.03)
        assert len(rows) >= 3
        np.testing.assert_allclose(rows[:, LATERAL], expected, atol=1.5e-3)
        assert np.all(np.hypot(*(rows[:, [X, Y]] - oval(now)[:2]).T) <= 0.03)


def test_neither_the_present_pass_nor_an_unseen_place_counts_as_an_earlier_pass():
    memory = watch(1.0, 4.0)
    assert len(recall(memory, packet_at(3.2, oval), 0.03)) == 0  # seen at this very pass
    assert len(recall(memory, packet_at(1.0 + 0.8 * LAP, oval), 0.03)) == 0  # not been there yet
    assert len(recall(memory, packet_at(2.0 + LAP, oval), 0.03)) >= 3
    assert recall(PredictionMemory(), packet_at(2.0, oval), 0.03).shape == (0, 12)


def test_the_two_passes_of_a_figure_eights_crossing_differ_in_direction():
    def wrong_on_one_branch(stamp, age):
        first_half = (stamp / LAP) % 1.0 < 0.25 or (stamp / LAP) % 1.0 > 0.75
        return (0.05 * age / HORIZON if first_half else 0.0), 0.0, 0.0

    memory = watch(1.0, 1.0 + 1.5 * LAP, path=figure_eight, error=wrong_on_one_branch)
    one = recall(memory, packet_at(2 * LAP, figure_eight), 0.03)
    other = recall(memory, packet_at(2.5 * LAP, figure_eight), 0.03)
    assert len(one) >= 3 and len(other) >= 3
    assert np.min(one[:, LATERAL]) > 0.04 and np.max(np.abs(other[:, LATERAL])) < 0.01


def test_a_gap_clears_predictions_whose_outcome_was_not_seen():
    memory = watch(1.0, 3.0)
    before = len(memory.records)
    assert memory.waiting
    memory = watch(4.0, 4.0 + 0.5 * HORIZON, memory=memory)
    assert len(memory.records) == before
    assert min(packet[0] for packet in memory.waiting) >= 4.0
    after = watch(4.0, 6.0, memory=watch(1.0, 3.0))
    assert not np.any((after.records[:, STAMP] > 3.0 - HORIZON + PERIOD) & (after.records[:, STAMP] < 4.0))
    assert len(after.records) > before


def test_lost_packets_do_not_change_the_verdict():
    rng = np.random.default_rng(4)
    memory = PredictionMemory()
    for stamp in np.arange(1.0, 6.0, 1.0 / 60.0):
        if rng.uniform() < 0.4:
            memory = remember(memory, packet_at(stamp, oval), HORIZON + rng.uniform(0.0, 0.03))
    assert len(memory.records) > 60
    assert np.max(np.abs(memory.records[:, LATERAL])) < 1.5e-3


def test_a_packet_is_accepted_once_and_only_in_order():
    memory = watch(1.0, 3.0)
    for stamp in (memory.waiting[-1][0], 2.0):
        assert remember(memory, packet_at(stamp, oval), HORIZON) is memory
    assert remember(memory, np.zeros(message_size(Prediction)), HORIZON) is memory


def test_whole_turns_of_the_direction_are_no_error():
    memory = PredictionMemory()
    for k, stamp in enumerate(np.arange(1.0, 4.0, PERIOD)):
        packet = packet_at(stamp, lambda t, turns=k % 3: oval(t) + [0, 0, 0, 2 * np.pi * turns])
        memory = remember(memory, packet, HORIZON)
    assert len(memory.records) > 50 and np.max(np.abs(memory.records[:, TURN])) < 2e-3


def test_recent_gives_the_records_within_the_duration():
    memory = watch(1.0, 6.0)
    rows = recent(memory, 6.0, 2.0)
    assert np.all(rows[:, STAMP] >= 4.0) and len(rows) == np.sum(memory.records[:, STAMP] >= 4.0) > 20
    assert recent(PredictionMemory(), 6.0, 2.0).shape == (0, 12)


def test_the_memory_is_bounded():
    memory = watch(1.0, 3.0)
    full = np.tile(memory.records[:1], (MAX_RECORDS, 1))
    memory = watch(4.0, 6.0, memory=PredictionMemory(memory.waiting, full))
    assert len(memory.records) == MAX_RECORDS
    assert memory.records[-1, STAMP] > 5.0  # the oldest go
    assert len(memory.waiting) <= HORIZON / PERIOD + 2


def test_an_old_memory_is_not_changed_by_a_new_one():
    old = watch(1.0, 3.0)
    count, waiting = len(old.records), len(old.waiting)
    watch(3.0, 4.0, memory=old)
    assert (len(old.records), len(old.waiting)) == (count, waiting)
    assert old.__deepcopy__({}) is old
    with pytest.raises(ValueError):
        old.records[0, 0] = 1.0


def test_a_prediction_at_the_wrong_height_is_wrong():
    memory = watch(1.0, 5.0)
    np.testing.assert_allclose(memory.records[:, HEIGHT], 0.0, atol=1e-9)
    config = GraspConfig()
    assert not is_wrong(config, memory.records).any()
    assert came_true(config, memory.records)[0] == Gate.OPEN
    records = memory.records.copy()
    records[-1, HEIGHT] = -1.1 * HEIGHT_LIMIT
    assert is_wrong(config, records).tolist() == [False] * (len(records) - 1) + [True]
    assert came_true(config, records)[0] == Gate.PREDICTIONS_FAILED
