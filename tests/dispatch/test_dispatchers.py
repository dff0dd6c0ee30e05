import dataclasses
import itertools
import math

import pytest
from belts import CELLS, ELIGIBILITY, MODEL, START, part, random_parts

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.dispatch import (
    DISPATCHERS,
    CycleTime,
    Dispatcher,
    FirstInFirstOut,
    FreeHand,
    Greedy,
    LookAhead,
    NearestDeadline,
    Plan,
    make_dispatcher,
)

KINDS = tuple(kind() for kind in DISPATCHERS.makers)


def choose(settings, parts, hand=START, cells=CELLS, now=0.0):
    return make_dispatcher(settings, MODEL, ELIGIBILITY).choose(hand, parts, cells, now)


def ends_of(order, hand, cells):
    """Times of the picks in a given order and the time at which the last one ends; None if one is impossible."""
    picks = []
    for candidate, cell in zip(order, cells):
        done = MODEL.after(hand, candidate, cell, 0.0)
        if done is None:
            return None
        picks.append(done[0])
        hand = done[1]
    return picks, hand.free_at


def best_by_brute_force(parts, hand, cells, depth):
    """The largest number of picks, and the earliest end with as many, over all sequences."""
    for count in range(min(depth, len(parts), len(cells)), 0, -1):
        found = [ends_of(order, hand, cells) for order in itertools.permutations(parts, count)]
        ends = [end for _, end in filter(None, found)]
        if ends:
            return count, min(ends)
    return 0, hand.free_at


@pytest.mark.parametrize("settings", KINDS, ids=lambda settings: type(settings).__name__)
class TestEveryKind:
    def test_is_a_dispatcher(self, settings):
        assert isinstance(make_dispatcher(settings, MODEL, ELIGIBILITY), Dispatcher)

    def test_nothing_to_pick(self, settings):
        assert choose(settings, []) == Plan()
        assert choose(settings, [part(1)], cells=()).number is None
        assert choose(settings, [part(1, y=0.34)]).number is None

    def test_only_parts_that_the_jaws_can_grasp(self, settings):
        crowded, vague, good = part(1, clear=0.005), part(2, std=0.02), part(3)
        assert choose(settings, [crowded, vague, good]).numbers == (3,)

    @pytest.mark.parametrize("seed", range(10))
    def test_a_plan_can_be_carried_out(self, settings, seed):
        parts = {candidate.number: candidate for candidate in random_parts(seed, 7)}
        plan = choose(settings, list(parts.values()))
        picks, _ = ends_of([parts[number] for number in plan.numbers], START, CELLS)
        assert len(set(plan.numbers)) == len(plan.numbers) > 0
        assert plan.pick_times == pytest.approx(picks)

    @pytest.mark.parametrize("seed", range(5))
    def test_the_order_of_the_parts_does_not_matter(self, settings, seed):
        parts = random_parts(seed, 7)
        assert choose(settings, parts) == choose(settings, parts[::-1]) == choose(settings, parts)


def test_first_in_first_out_picks_the_lowest_number_that_it_can():
    parts = [part(3, y=0.2), part(2, y=-0.3), part(1, y=0.345)]
    assert choose(FirstInFirstOut(), parts).numbers == (2,)


def test_nearest_deadline_picks_the_part_that_leaves_first():
    slow_ahead, fast_behind, upstream = part(1, y=0.1, v=0.05), part(2, y=-0.05, v=0.12), part(3, y=-0.3, v=0.1)
    assert choose(NearestDeadline(), [slow_ahead, fast_behind, upstream]).numbers == (2,)


def test_greedy_picks_the_part_after_which_the_hand_is_free_first():
    parts = random_parts(1, 8)
    ends = {}
    for candidate in parts:
        done = MODEL.after(START, candidate, CELLS[0], 0.0)
        if done:
            ends[candidate.number] = done[1].free_at
    assert choose(Greedy(), parts).numbers == (min(ends, key=ends.get),)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("depth", [2, 5])
def test_look_ahead_is_optimal(seed, depth):
    parts = random_parts(seed, 5, last=0.2)
    hand = FreeHand(0.41, -0.3 + 0.05 * seed, 0.1 * seed)
    plan = choose(LookAhead(depth=depth), parts, hand)
    count, end = best_by_brute_force(parts, hand, CELLS, depth)
    by_number = {candidate.number: candidate for candidate in parts}
    assert len(plan.numbers) == count
    assert ends_of([by_number[number] for number in plan.numbers], hand, CELLS)[1] == pytest.approx(end)


def test_look_ahead_first_picks_the_part_that_will_leave():
    """The greedy rule picks the near part; the other one has left by then."""
    parts = [part(1, x=0.52, y=-0.1), part(2, x=0.68, y=0.10)]
    assert choose(Greedy(), parts).number == 1
    assert choose(LookAhead(), parts).numbers == (2, 1)


def test_a_beam_finds_a_plan_of_parts_that_are_too_many_for_an_exact_search(monkeypatch):
    parts = random_parts(5, 10, last=0.0)
    monkeypatch.setattr(LookAhead, "exact_up_to", 12)
    exact = choose(LookAhead(), parts)
    monkeypatch.setattr(LookAhead, "exact_up_to", 4)
    beam, narrow = choose(LookAhead(width=8), parts), choose(LookAhead(width=1), parts)
    assert len(narrow.numbers) <= len(beam.numbers) <= len(exact.numbers)
    assert narrow.number == choose(Greedy(), parts).number


def test_a_plan_ends_at_the_depth_the_horizon_and_the_last_cell():
    parts = [part(number, y=-0.5 + 0.1 * number) for number in range(1, 4)]
    assert len(choose(LookAhead(), parts).numbers) == 3
    assert len(choose(LookAhead(depth=1), parts).numbers) == 1
    assert len(choose(LookAhead(), parts, cells=CELLS[:2]).numbers) == 2
    horizon = choose(LookAhead(), parts).pick_times[1]
    assert len(choose(LookAhead(horizon=horizon + 0.01), parts).numbers) == 2


def test_all_settings_are_within_their_ranges():
    for settings in (*KINDS, CycleTime(), MODEL.window, ELIGIBILITY):
        for field in dataclasses.fields(settings):
            low, high = field.metadata["range"]
            assert low <= getattr(settings, field.name) <= high and math.isfinite(high)


def test_settings_of_no_kind_are_refused():
    with pytest.raises(DrakeTrackerError, match="dispatch: kind is .*allowed are first_in_first_out, greedy"):
        make_dispatcher(CycleTime(), MODEL, ELIGIBILITY)
