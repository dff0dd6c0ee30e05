"""The rules of the receiver, and what it remembers."""

import numpy as np
import pytest
from packets import (
    BAD_PACKETS,
    TABLE_HEIGHT,
    TRAIN_Z,
    VOLUME,
    circle_packet,
    column,
    moved,
    shifted,
    with_fields,
    with_knots,
)
from variants import variant

from drake_tracker.arm.config import PacketGuardConfig
from drake_tracker.arm.safety.packet_guard import (
    LARGEST_ACCELERATION,
    REASONS,
    PacketGuard,
    Rejection,
    describe_rejections,
)
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    PacketReport,
    Prediction,
    message_size,
)
from drake_tracker.core.timing import PATH_DURATION

NOW, LAG = 10.0, 0.25
SETTINGS = PacketGuardConfig()
GUARD = PacketGuard(SETTINGS, VOLUME, TABLE_HEIGHT)
GOOD = circle_packet(NOW - LAG)
TIMES = KNOT_SPACING * np.arange(KNOT_COUNT)


def along_x(positions):
    """A good packet with other positions along x."""
    return with_knots(GOOD, column(0, positions))


@pytest.mark.parametrize("spoil, rejection", BAD_PACKETS.values(), ids=BAD_PACKETS)
def test_each_kind_of_bad_packet_is_rejected_for_its_own_reason(spoil, rejection):
    assert GUARD.check(spoil(GOOD), NOW) == rejection


def test_there_is_a_bad_packet_words_and_a_count_for_each_reason():
    every = set(Rejection) - {Rejection.NONE}
    assert {rejection for _, rejection in BAD_PACKETS.values()} == set(REASONS) == every
    assert list(PacketReport.get_fields()[3:]) == [reason.name.lower() for reason in Rejection][1:]


GOOD_PACKETS = {
    "a train on a circle": GOOD,
    "just made": shifted(GOOD, LAG),
    "a rounded clock": shifted(GOOD, LAG + SETTINGS.clock_tolerance),
    "about to end": shifted(GOOD, LAG - PATH_DURATION),
    "where vision ends": with_knots(GOOD, lambda knots: knots + [*(VOLUME[1] + 0.05 - knots[0, :3]), 0, 0]),
    "a train that leaves, at 1 m/s": along_x(0.79 + TIMES),
    "the fastest train": along_x(0.4 + 1.9 * TIMES),
    "an extrapolated bend, at 1 m/s": along_x(0.5 + TIMES + 0.5 * 1.0 / 0.116 * TIMES**2),
    "free fall from the table": with_knots(GOOD, column(0, 0.5 - 0.5 * LARGEST_ACCELERATION * TIMES**2)),
    "a height that is uncertain": with_knots(
        with_knots(GOOD, column(2, TRAIN_Z - 0.1 * TIMES)), column(4, 0.003 + 0.1 * TIMES)
    ),
    "about turn": with_knots(GOOD, column(3, np.where(TIMES > 0.7, np.pi, 0.0))),
    "many laps": with_knots(GOOD, moved(0, 0, 0, 2 * np.pi * 1e4, 0)),
    "a host that restarted": with_fields(GOOD, seq=0.0),
}


@pytest.mark.parametrize("packet", GOOD_PACKETS.values(), ids=GOOD_PACKETS)
def test_what_an_estimator_may_predict_is_accepted(packet):
    assert GUARD.check(packet, NOW) == Rejection.NONE


def test_clocks_that_count_from_1970_are_accurate_enough():
    assert GUARD.check(shifted(GOOD, 1.7e9 + 0.123456), 1.7e9 + NOW) == Rejection.NONE


def test_without_a_table_a_path_may_fall_through_the_floor():
    falling = with_knots(GOOD, column(2, TRAIN_Z - 0.5 * LARGEST_ACCELERATION * TIMES**2))
    assert PacketGuard(SETTINGS, VOLUME).check(falling, NOW) == Rejection.NONE
    assert GUARD.check(falling, NOW) == Rejection.BELOW_TABLE


@pytest.mark.parametrize(
    "settings, packet, rejection",
    [
        (PacketGuardConfig(margin=0.0), with_knots(GOOD, moved(0.18, 0, 0, 0, 0)), Rejection.OUTSIDE),
        (variant(PacketGuardConfig, max_speed=0.7)(), along_x(0.4 + TIMES), Rejection.TOO_FAST),
        (variant(PacketGuardConfig, clock_tolerance=0.0)(), shifted(GOOD, LAG + 0.0005), Rejection.FUTURE),
        (
            variant(PacketGuardConfig, table_tolerance=0.01)(),
            with_knots(with_knots(GOOD, column(2, TABLE_HEIGHT - 0.02)), column(4, 0.1)),
            Rejection.BELOW_TABLE,
        ),
    ],
)
def test_each_limit_is_a_setting(settings, packet, rejection):
    assert PacketGuard(settings, VOLUME + [[-0.01], [0.01]], TABLE_HEIGHT).check(packet, NOW) == rejection
    assert GUARD.check(packet, NOW) == Rejection.NONE


def test_a_rejected_packet_leaves_the_last_good_one_and_is_counted_once():
    state = GUARD.update(GUARD.initial_state(), NOW, GOOD)
    bad = with_fields(GOOD, spacing=1e300, stamp=NOW)
    for _ in range(3):
        np.testing.assert_array_equal(GUARD.accepted(state, NOW, bad), GOOD)
        state = GUARD.update(state, NOW, bad)
    report = PacketReport(GUARD.report(state))
    assert (report.received, report.rejected, report.reason, report.spacing) == (2, 1, Rejection.SPACING, 1)
    assert describe_rejections(report[:]) == {"spacing": 1}
    newer = circle_packet(NOW)
    np.testing.assert_array_equal(GUARD.accepted(state, NOW, newer), newer)


def test_a_good_packet_that_is_older_than_another_is_neither_used_nor_counted_as_bad():
    state = GUARD.update(GUARD.initial_state(), NOW, GOOD)
    state = GUARD.update(state, NOW, shifted(GOOD, -0.1))
    np.testing.assert_array_equal(state.accepted, GOOD)
    assert PacketReport(GUARD.report(state)).rejected == 0


def test_a_vector_without_a_packet_is_not_counted():
    nothing = np.zeros(message_size(Prediction))
    state = GUARD.update(GUARD.initial_state(), NOW, nothing)
    state = GUARD.update(state, NOW, with_fields(np.full(message_size(Prediction), np.nan), valid=0.0))
    assert not GUARD.report(state).any() and not state.accepted.any()


def test_a_packet_that_is_early_is_not_accepted_when_its_time_has_come():
    early = shifted(GOOD, LAG + 1.0)
    state = GUARD.update(GUARD.initial_state(), NOW, early)
    assert not GUARD.accepted(state, NOW + 2.0, early).any()


def test_the_state_keeps_its_own_copy():
    packet = GOOD.copy()
    state = GUARD.update(GUARD.initial_state(), NOW, packet)
    packet[:] = 7.0
    np.testing.assert_array_equal(state.accepted, GOOD)
    with pytest.raises(ValueError, match="read-only"):
        state.accepted[0] = 1.0
