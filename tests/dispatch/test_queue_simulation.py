import itertools
import math

import numpy as np
import pytest
from belts import CELLS, ELIGIBILITY, MODEL, START, part

from drake_tracker.dispatch import (
    DISPATCHERS,
    FirstInFirstOut,
    Greedy,
    LookAhead,
    PartArrival,
    Plan,
    SimulatedBelt,
    bunched_arrivals,
    even_arrivals,
    make_dispatcher,
    poisson_arrivals,
    simulate_queue,
)
from drake_tracker.dispatch import offline_optimum as clairvoyant

BELT = SimulatedBelt()
DURATION = 40.0
KINDS = tuple(kind() for kind in DISPATCHERS.makers)
WAIT = (0.60, -0.35)


def arrivals_of(seed):
    """Poisson arrivals or bunches, on a slow or a fast belt."""
    belt = SimulatedBelt(speed=(0.06, 0.10, 0.15)[seed % 3])
    if seed % 2:
        return poisson_arrivals(belt, 0.6, DURATION, seed)
    return bunched_arrivals(belt, 0.6, 4, DURATION, seed)


def simulate(settings, arrivals, duration=DURATION, wait=None):
    dispatcher = make_dispatcher(settings, MODEL, ELIGIBILITY)
    return simulate_queue(dispatcher, MODEL, arrivals, START, CELLS, BELT.y_seen, duration, wait)


def bunches(belt, rate, duration, seed):
    return bunched_arrivals(belt, rate, 5, duration, seed)


def even(belt, rate, duration, seed):
    return even_arrivals(belt, rate, 0.3, duration, seed)


@pytest.mark.parametrize("make", [poisson_arrivals, bunches, even])
def test_arrivals_keep_their_distance_and_their_rate(make):
    arrivals = make(BELT, 0.5, 1000.0, 3)
    assert 400 < len(arrivals) < 600
    assert [arrival.number for arrival in arrivals] == list(range(1, len(arrivals) + 1))
    assert np.all(np.diff([arrival.time for arrival in arrivals]) >= 0.0)
    places = np.array([(arrival.x, arrival.time * BELT.speed) for arrival in arrivals])
    for i in range(1, 12):
        assert np.min(np.hypot(*(places[i:] - places[:-i]).T)) >= BELT.spacing - 1e-12
    assert make(BELT, 0.5, 1000.0, 3) == arrivals != make(BELT, 0.5, 1000.0, 4)


def test_intervals_of_even_arrivals_vary_by_no_more_than_they_may():
    intervals = np.diff([arrival.time for arrival in even(BELT, 0.3, 1000.0, 1)])
    assert np.abs(0.3 * intervals - 1.0).max() <= 0.3 + 1e-9
    assert np.ptp(0.3 * intervals) > 0.5


def test_bunches_are_denser_than_independent_arrivals():
    def near(arrivals):
        return np.mean(np.diff([arrival.time for arrival in arrivals]) < 1.0)

    assert near(bunched_arrivals(BELT, 0.3, 5, 1000.0, 1)) > 1.5 * near(poisson_arrivals(BELT, 0.3, 1000.0, 1))


@pytest.mark.parametrize("settings", KINDS, ids=lambda settings: type(settings).__name__)
@pytest.mark.parametrize("seed", range(6))
def test_a_run_is_possible(settings, seed):
    arrivals = arrivals_of(seed)
    run = simulate(settings, arrivals, wait=WAIT if seed > 2 else None)
    seen = {arrival.number: arrival.time for arrival in arrivals}
    picked = [pick.number for pick in run.picks]
    assert len(set(picked)) == len(picked) > 5
    for pick in run.picks:
        assert -0.40 - 1e-9 <= pick.y <= 0.42 + 1e-9
        assert seen[pick.number] <= pick.start < pick.time < pick.end
        assert pick.time <= DURATION
    assert all(pick.end <= following.start for pick, following in itertools.pairwise(run.picks))
    assert not set(run.missed) & set(picked)
    assert run.picks_per_minute == len(picked) * 60.0 / DURATION
    assert simulate(settings, arrivals, wait=WAIT if seed > 2 else None) == run


def test_a_part_is_missed_when_it_has_left_the_window():
    arrivals = [PartArrival(1, 0.0, 0.6, 0.10), PartArrival(2, 0.1, 0.52, 0.10), PartArrival(3, 39.0, 0.6, 0.10)]
    one_pick = simulate(FirstInFirstOut(), arrivals, duration=2.0)
    assert [pick.number for pick in one_pick.picks] == [1] and one_pick.missed == ()
    crowd = [PartArrival(number, 0.01 * number, 0.5 + 0.02 * number, 0.10) for number in range(1, 9)]
    run = simulate(FirstInFirstOut(), crowd)
    assert sorted([*run.missed, *(pick.number for pick in run.picks)]) == list(range(1, 9)) and run.missed


def test_waiting_above_the_beginning_of_the_window_saves_time():
    arrivals = [PartArrival(1, 10.0, 0.6, 0.10)]
    near, far = simulate(Greedy(), arrivals, wait=WAIT), simulate(Greedy(), arrivals)
    assert near.picks[0].time < far.picks[0].time


def test_a_choice_that_is_impossible_is_an_error():
    class Wrong:
        def choose(self, hand, candidates, cells, now):
            return Plan((candidates[0].number,), (now,)) if candidates else Plan()

    arrivals = [PartArrival(1, 0.0, 0.6, 0.10), PartArrival(2, 30.0, 0.6, 0.10)]
    fast = [PartArrival(1, 0.0, 0.6, 5.0), *arrivals[1:]]
    with pytest.raises(ValueError, match="part 1 cannot be picked"):
        simulate_queue(Wrong(), MODEL, fast, START, CELLS, BELT.y_seen, DURATION)


@pytest.mark.parametrize("seed", range(12))
def test_no_dispatcher_exceeds_the_bound(seed):
    arrivals = arrivals_of(seed)
    bound = clairvoyant(MODEL, arrivals, START, CELLS, BELT.y_seen, DURATION)
    loose = clairvoyant(MODEL, arrivals, START, CELLS, BELT.y_seen, DURATION, width=3)
    assert len(loose.numbers) <= len(bound.numbers) == bound.upper <= loose.upper
    for settings, wait in itertools.product(KINDS, (None, WAIT)):
        assert len(simulate(settings, arrivals, wait=wait).picks) <= bound.upper


def test_look_ahead_picks_more_than_the_queue_and_nearly_as_many_as_the_clairvoyant():
    """Bunches of four on a slow belt, more than the arm can pick."""
    belt, totals = SimulatedBelt(speed=0.06), np.zeros(3, int)
    for seed in range(3):
        arrivals = bunched_arrivals(belt, 0.8, 4, 120.0, seed)
        totals += [
            len(simulate(FirstInFirstOut(), arrivals, 120.0, WAIT).picks),
            len(simulate(LookAhead(), arrivals, 120.0, WAIT).picks),
            clairvoyant(MODEL, arrivals, START, CELLS, belt.y_seen, 120.0).upper,
        ]
    assert totals[1] >= 1.08 * totals[0]
    assert totals[1] >= 0.93 * totals[2]


def test_an_arrival_moves_with_the_belt():
    candidate = PartArrival(3, 2.0, 0.6, 0.1).candidate(-0.45, 5.0)
    assert candidate == part(3, 0.6, candidate.y, std=0.0)
    assert candidate.y == pytest.approx(-0.15) and math.isinf(candidate.clear)
