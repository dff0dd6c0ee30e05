import pytest

from drake_tracker.network.cycles import AGREEING, LATEST_TIME, LONGEST_GAP, REORDERED, CycleCollector

PERIOD = 1.0 / 60.0


def collect(*messages, channels=("left", "right")):
    """What comes of messages (channel, cycle): rows (number, channels, anew)."""
    collector = CycleCollector(channels, PERIOD)
    ended = []
    for channel, cycle in messages:
        ended += collector.put(channel, cycle * PERIOD, None)
    return [(cycle.number, "".join(sorted(name[0] for name in cycle.messages)), cycle.anew) for cycle in ended]


def test_a_cycle_ends_when_it_is_complete():
    assert collect(("left", 0), ("right", 0), ("right", 1), ("left", 1)) == [(0, "lr", True), (1, "lr", False)]


def test_an_incomplete_cycle_ends_when_the_next_begins():
    came = collect(("left", 0), ("left", 1), ("right", 1), ("right", 2), ("left", 4), ("right", 4))
    assert came == [(0, "l", True), (1, "lr", False), (2, "r", False), (4, "lr", False)]


def test_late_and_repeated_messages_are_ignored():
    late = [("left", 8), ("right", 7), ("left", 8 - REORDERED)]
    came = collect(("left", 8), ("right", 8), *late, ("left", 9), ("right", 9))
    assert came == [(8, "lr", True), (9, "lr", False)]


def both(*cycles):
    """Complete cycles."""
    return [(channel, cycle) for cycle in cycles for channel in ("left", "right")]


FAR = [0, 100 - REORDERED - AGREEING, 100 + LONGEST_GAP + 1, round(LATEST_TIME / PERIOD) - AGREEING]


@pytest.mark.parametrize("cycle", FAR)
def test_a_clock_that_jumps_has_restarted_once_several_cycles_agree(cycle):
    agreeing = range(cycle, cycle + AGREEING)
    came = collect(*both(100, *agreeing))
    assert came == [(100, "lr", True), (cycle, "lr", True), *((number, "lr", False) for number in agreeing[1:])]


@pytest.mark.parametrize("cycle", [*FAR, 100 + REORDERED + 5])
def test_fewer_cycles_with_another_time_change_nothing(cycle):
    wrong = both(*range(cycle, cycle + AGREEING))[:-2]
    came = collect(*both(100), *wrong, *both(101), *wrong, *both(102))
    assert came == [(100, "lr", True), (101, "lr", False), (102, "lr", False)]


def test_wrong_times_that_do_not_agree_change_nothing():
    came = collect(*both(100, *range(1000, 9000, 50), 101))
    assert came == [(100, "lr", True), (101, "lr", False)]


def test_a_gap_is_no_restart():
    later = 100 + LONGEST_GAP
    came = collect(*both(100, later, later + 1, later + 2))
    assert came == [(100, "lr", True), *((number, "lr", False) for number in range(later, later + 3))]


def test_what_is_put_aside_is_bounded():
    collector = CycleCollector(["left"], PERIOD)
    collector.put("left", 0.0, None)
    for _ in range(100_000):
        collector.put("left", 5000 * PERIOD, None)
    assert len(collector._aside) <= 2 * AGREEING


def test_a_clock_that_jumps_ends_the_open_cycle():
    came = collect(("left", 100), *both(0, 1, 2))
    assert came == [(100, "l", True), (0, "lr", True), (1, "lr", False), (2, "lr", False)]


def test_times_in_whole_milliseconds_are_accurate_enough():
    collector = CycleCollector(["point"], PERIOD)
    numbers = [collector.put("point", 1e-3 * round(1e3 * (k * PERIOD + 0.0008)), None)[0].number for k in range(600)]
    assert numbers == list(range(600))
