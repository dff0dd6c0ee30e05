"""Compares the dispatchers on random arrivals, without physics, with an arm that knows all arrivals.

    python benchmarks/dispatch.py                 all cases, 50 seeds each: some minutes
    python benchmarks/dispatch.py --seeds 5       a quick look; nothing is written

The dispatchers are compared in runs of 120 s with 0.8 parts per second, more than twice what the arm can pick.
"clairvoyant" is the largest number of picks of an arm that knows all arrivals; where its search was not exact, the
upper bound is given. Intervals are 95 % bootstrap intervals over the seeds of the ratio of two means; the seeds are
resampled in pairs.

A second table tells what share of the parts is missed at a part of the capacity, when they arrive independently of each
other and evenly, and on pieces of belt of different lengths. Here parts arrive for 120 s, and the run ends when all of
them have left the window.
"""

import argparse

import numpy as np
from shared import common

from drake_tracker.dispatch import (
    DISPATCHERS,
    Cell,
    CycleModel,
    CycleTime,
    Eligibility,
    FreeHand,
    PickWindow,
    SimulatedBelt,
    bunched_arrivals,
    even_arrivals,
    make_dispatcher,
    poisson_arrivals,
    simulate_queue,
)
from drake_tracker.dispatch import offline_optimum as clairvoyant

RESULTS = common.RESULTS / "dispatch.json"
FIRST_SEED = 100
"""First of the seeds. The place where the hand waits and the depth of the plan were chosen on seeds 0 to 19."""
DURATION, RATE = 120.0, 0.8
SPEEDS, BUNCHES = (0.10, 0.06), (1, 4)
"""A bunch of one part stands for Poisson arrivals."""
ROWS = [0.19 + 0.065 * row for row in range(6)]
CELLS = tuple(Cell(x, y) for y in (*(-row for row in ROWS), *reversed(ROWS)) for x in (0.345, 0.410))
"""The cells in the order in which the conveyor fills them."""
START, WAIT = FreeHand(0.60, -0.30, 0.0), (0.60, -0.30)
RESAMPLES = 2000
LOAD_SPEED, LOADS = 0.15, (0.4, 0.6, 0.8, 1.0)
"""Speed of the belt [m/s], and parts that arrive for each that the arm can pick, in the table of the loads."""
VARIATION = 0.3
"""Of even arrivals."""
LENGTHS = {0.82: PickWindow(), 1.20: PickWindow(-0.60, 0.60), 2.40: PickWindow(-1.20, 1.20)}
"""{length of the window [m]: the window}. The second is at the limit of the PUMA's reach, the last far beyond it."""


def picks_by(name, model, arrivals, belt, duration):
    """Returns the number of picks of a dispatcher, or of "clairvoyant" at most."""
    arguments = (arrivals, START, CELLS, belt.y_seen, duration)
    if name == "clairvoyant":
        return clairvoyant(model, *arguments).upper
    dispatcher = make_dispatcher(DISPATCHERS.names[name](), model, Eligibility())
    return len(simulate_queue(dispatcher, model, *arguments, WAIT).picks)


def picks_of(belt, bunch, seed):
    """Returns {name of a dispatcher, or "clairvoyant": number of picks}, and whether the bound is exact."""
    if bunch == 1:
        arrivals = poisson_arrivals(belt, RATE, DURATION, seed)
    else:
        arrivals = bunched_arrivals(belt, RATE, bunch, DURATION, seed)
    model = CycleModel(CycleTime(), PickWindow())
    picks = {name: picks_by(name, model, arrivals, belt, DURATION) for name in DISPATCHERS.names}
    bound = clairvoyant(model, arrivals, START, CELLS, belt.y_seen, DURATION)
    picks["clairvoyant"] = bound.upper
    return picks, bound.upper == len(bound.numbers)


def ratio(numbers, over):
    """Returns the ratio of two means and its bootstrap interval."""
    rng = np.random.default_rng(0)
    sample = rng.integers(0, len(numbers), (RESAMPLES, len(numbers)))
    ratios = numbers[sample].mean(axis=1) / over[sample].mean(axis=1)
    return [float(value) for value in (numbers.mean() / over.mean(), *np.quantile(ratios, (0.025, 0.975)))]


def compare(speed, bunch, seeds):
    """Returns the result of a case."""
    runs = [picks_of(SimulatedBelt(speed=speed), bunch, seed) for seed in seeds]
    counts = {name: np.array([picks[name] for picks, _ in runs], float) for name in runs[0][0]}
    ones = np.ones(len(runs))
    return {
        "speed": speed,
        "bunch": bunch,
        "exact_bounds": sum(exact for _, exact in runs),
        "per_minute": {name: ratio(60.0 / DURATION * count, ones) for name, count in counts.items()},
        "of_clairvoyant": {name: ratio(count, counts["clairvoyant"]) for name, count in counts.items()},
        "of_first_in_first_out": {name: ratio(count, counts["first_in_first_out"]) for name, count in counts.items()},
    }


def missed_at(rate, model, belt, even, seeds):
    """Returns {name of a dispatcher, or "clairvoyant": share of the parts that is missed at a rate [1/s]}."""
    end = DURATION + (model.window.y_last - belt.y_seen) / belt.speed
    runs = [
        even_arrivals(belt, rate, VARIATION, DURATION, seed) if even else poisson_arrivals(belt, rate, DURATION, seed)
        for seed in seeds
    ]
    arrived = np.array([len(arrivals) for arrivals in runs], float)
    return {
        name: ratio(arrived - [picks_by(name, model, arrivals, belt, end) for arrivals in runs], arrived)
        for name in ("look_ahead", "greedy", "first_in_first_out", "clairvoyant")
    }


def load_cases(seeds):
    """Returns the results of the second table, and prints them."""
    cases = []
    for length, window in LENGTHS.items():
        model = CycleModel(CycleTime(), window)
        belt = SimulatedBelt(speed=LOAD_SPEED, y_seen=window.y_first - 0.05)
        saturated = [poisson_arrivals(belt, RATE, DURATION, seed) for seed in seeds]
        capacity = np.mean([picks_by("look_ahead", model, run, belt, DURATION) for run in saturated]) / DURATION
        for pattern in ("independent", "even"):
            for load in LOADS:
                missed = missed_at(load * capacity, model, belt, pattern == "even", seeds)
                case = {"length": length, "pattern": pattern, "load": load, "per_minute": 60.0 * load * capacity}
                cases.append({**case, "missed": missed})
                print(*case.values(), *(f"{name} {value[0]:.1%}" for name, value in missed.items()), flush=True)
    return cases


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=50, help="runs of each case")
    options = parser.parse_args()
    seeds = range(FIRST_SEED, FIRST_SEED + options.seeds)
    rows, results = [], []
    for speed in SPEEDS:
        for bunch in BUNCHES:
            result = compare(speed, bunch, seeds)
            results.append(result)
            names = (*DISPATCHERS.names, "clairvoyant")
            means = [f"{result['per_minute'][name][0]:.1f}" for name in names]
            share = "{:.1%} ({:.1%} to {:.1%})".format(*result["of_clairvoyant"]["look_ahead"])
            gain = "{:+.1%} ({:+.1%} to {:+.1%})".format(
                *(value - 1.0 for value in result["of_first_in_first_out"]["look_ahead"])
            )
            rows.append([speed, bunch, *means, share, gain, f"{result['exact_bounds']}/{len(seeds)}"])
            print(*rows[-1], flush=True)
    header = [
        "belt [m/s]",
        "bunch",
        *DISPATCHERS.names,
        "clairvoyant",
        "look_ahead / clairvoyant",
        "over FIFO",
        "exact",
    ]
    common.print_table(header, rows)
    results = {"cases": results, "loads": load_cases(seeds)}
    common.save_json(results, RESULTS if options.seeds == 50 else None, seeds)


if __name__ == "__main__":
    main()
