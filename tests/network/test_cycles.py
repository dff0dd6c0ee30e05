import pytest

from drake_tracker.network.cycles import LONGEST_GAP, REORDERED, CycleCollector

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


@pytest.mark.parametrize("cycle", [0, 100 - REORDERED - 1, 100 + LONGEST_GAP + 1])
def test_a_clock_that_jumps_has_restarted(cycle):
    came = collect(("left", 100), ("right", 100), ("left", cycle), ("right", cycle))
    assert came == [(100, "lr", True), (cycle, "lr", True)]


def test_a_clock_that_jumps_ends_the_open_cycle():
    assert collect(("left", 100), ("left", 0), ("right", 0)) == [(100, "l", True), (0, "lr", True)]


def test_times_in_whole_milliseconds_are_accurate_enough():
    collector = CycleCollector(["point"], PERIOD)
    numbers = [collector.put("point", 1e-3 * round(1e3 * (k * PERIOD + 0.0008)), None)[0].number for k in range(600)]
    assert numbers == list(range(600))
