import itertools

import numpy as np
import pytest
from belts import CELLS, MODEL, START
from scipy.optimize import Bounds, LinearConstraint, milp

from drake_tracker.dispatch import CycleModel, CycleTime, PartArrival, PickWindow
from drake_tracker.dispatch import offline_optimum as clairvoyant

Y_SEEN = -0.45


def crowd(seed, count, within):
    """Parts with different speeds that come into view within a time."""
    rng = np.random.default_rng([seed, 7])
    times = sorted(rng.uniform(0.0, within, count))
    return [PartArrival(i + 1, t, rng.uniform(0.5, 0.7), rng.uniform(0.06, 0.16)) for i, t in enumerate(times)]


def picks_in(order, arrivals, duration):
    """Number of picks when parts are picked in an order; those that are impossible end it."""
    hand, count, times = START, 0, []
    for i, cell in zip(order, CELLS):
        done = MODEL.after(hand, arrivals[i].candidate(Y_SEEN, 0.0), cell, 0.0)
        if done is None or done[0] > duration:
            break
        hand, count = done[1], count + 1
        times.append(done[0])
    return count, times


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("duration", [8.0, 30.0])
def test_the_bound_is_exact_on_few_parts(seed, duration):
    arrivals = crowd(seed, 6, 6.0)
    best = max(picks_in(order, arrivals, duration)[0] for order in itertools.permutations(range(6)))
    bound = clairvoyant(MODEL, arrivals, START, CELLS, Y_SEEN, duration)
    assert bound.upper == len(bound.numbers) == best
    for width in (1, 2, 4):
        loose = clairvoyant(MODEL, arrivals, START, CELLS, Y_SEEN, duration, width)
        assert len(loose.numbers) <= best <= loose.upper


@pytest.mark.parametrize("width", [1, 400])
def test_the_schedule_can_be_carried_out(width):
    arrivals = crowd(3, 30, 40.0)
    bound = clairvoyant(MODEL, arrivals, START, CELLS, Y_SEEN, 60.0, width)
    count, times = picks_in([number - 1 for number in bound.numbers], arrivals, 60.0)
    assert count == len(bound.numbers) == len(set(bound.numbers)) > 10
    assert bound.pick_times == pytest.approx(times)


def most_jobs(first, last, follow, cycle):
    """The largest number of picks, by integer programming, when the hand needs no time to move.

    Unknowns: z_i, whether part i is picked; t_i, when; b_ij, whether i comes before j. All picks are ``cycle`` apart.
    """
    n = len(first)
    pairs = list(itertools.combinations(range(n), 2))
    size, big = 2 * n + len(pairs), max(last) + cycle
    rows, least = [], []
    for k, (i, j) in enumerate(pairs):
        for one, other, sign in ((i, j, -1.0), (j, i, 1.0)):
            row = np.zeros(size)
            row[n + other], row[n + one] = 1.0, -1.0  # t_other - t_one >= cycle, unless ...
            row[2 * n + k] = sign * 2.0 * big  # ... the other one comes first
            row[[one, other]] = -2.0 * big  # ... or one is not picked
            rows.append(row)
            least.append(cycle - 4.0 * big - (2.0 * big if sign < 0.0 else 0.0))
    low = np.concatenate([np.zeros(n), np.maximum(first, follow), np.zeros(len(pairs))])
    high = np.concatenate(
        [(low[n : 2 * n] <= last).astype(float), np.maximum(last, low[n : 2 * n]), np.ones(len(pairs))]
    )
    integers = np.concatenate([np.ones(n), np.zeros(n), np.ones(len(pairs))])
    cost = np.concatenate([-np.ones(n), np.zeros(size - n)])
    result = milp(
        cost, constraints=LinearConstraint(np.array(rows), least), bounds=Bounds(low, high), integrality=integers
    )
    assert result.success
    return round(-result.fun)


@pytest.mark.parametrize("seed", range(6))
def test_the_bound_agrees_with_integer_programming(seed):
    cycle = CycleTime(approach_speed=1e6, carry_speed=1e6, approach_acceleration=1e9, carry_acceleration=1e9)
    model = CycleModel(cycle, PickWindow())
    arrivals = crowd(seed, 8, 6.0)
    windows = np.array([model.in_window(arrival.candidate(Y_SEEN, 0.0), 0.0) for arrival in arrivals])
    follow = cycle.descent + cycle.close
    duration = cycle.descent + cycle.close + cycle.lift + cycle.lower + cycle.release + cycle.rise
    expected = most_jobs(windows[:, 0], windows[:, 1], follow, duration)
    bound = clairvoyant(model, arrivals, START, CELLS, Y_SEEN, 100.0)
    assert bound.upper == len(bound.numbers) == expected


def test_nothing_arrives():
    bound = clairvoyant(MODEL, [], START, CELLS, Y_SEEN, 60.0)
    assert (bound.numbers, bound.pick_times, bound.upper) == ((), (), 0)
