"""Compares measured vision with cameras: how often the train is lifted with each, and the processor time of each.

    python benchmarks/measured_vision.py [--turns N] [--json FILE]

The runs with cameras are those of the ladder in ``results/train_grasp.jsonl`` with the plain train in plain light. Each
is repeated with measured vision and the same scenario, track, speed and seed; these runs go to
``results/measured_vision.jsonl`` and are not repeated. For the processor time, both kinds of vision take turns in one
process, one simulated second at a time.
"""

import argparse
import os
import statistics
import time
from pathlib import Path

from shared import common
from shared.common import append_results, print_table, save_json, share
from shared.stored import read_lines
from train_grasp import ESTIMATORS, FIRST_SEED, RUNGS, SEEDS, TRACKS, is_rung, make_job, outcome, run_one

CAMERAS = common.RESULTS / "train_grasp.jsonl"
RESULTS = common.RESULTS / "measured_vision.jsonl"
MEASURED = "vision=!Measured {}"
PLAIN = [f"{track}-{speed:.2f}" for track in TRACKS for speed in (0.10, 0.15, 0.20)]
"""Cells with the plain train in plain light."""
TURN, WARM_UP = 1.0, 3
"""Simulated time [s] of each turn of the timing, and turns that do not count."""
MEDIANS = ("triangulation_jitter_m", "prediction_rms_m")


def key_of(row):
    """Returns (scenario, cell, seed) of a run."""
    return row["scenario"], row["cell"], row["seed"]


def describe(row):
    return f"{row['scenario']} {row['cell']} seed {row['seed']}: {outcome(row)}"


def of_ladder(rows):
    """Returns the runs with cameras that are repeated."""
    seeds = range(FIRST_SEED, FIRST_SEED + SEEDS)
    return [row for row in rows if is_rung(row) and row["cell"] in PLAIN and row["seed"] in seeds]


def pairs_of(cameras, measured):
    """Returns (row with cameras, row with measured vision) of the runs that exist with both."""
    repeated = {key_of(row): row for row in measured}
    return [(row, repeated[key_of(row)]) for row in of_ladder(cameras) if key_of(row) in repeated]


def vision_table(pairs):
    """Returns (header, rows) of a table with one row per scenario: lifted trains and median errors of both kinds."""
    lines = []
    for scenario in RUNGS:
        both = [pair for pair in pairs if pair[0]["scenario"] == scenario]
        if not both:
            continue
        counts = [sum(bool(row["success"]) for row in kind) for kind in zip(*both)]
        shown = [text for count in counts for text in share(count, len(both))]
        errors = [
            f"{1e3 * statistics.median(row[what] for row in kind if row.get(what) is not None):.2f} mm"
            for what in MEDIANS
            for kind in zip(*both)
        ]
        difference = 100.0 * (counts[1] - counts[0]) / len(both)
        lines.append([f"`{scenario}`", len(both), *shown, f"{round(difference):+d}", *errors])
    header = ["scenario", "runs", "lifted with cameras", "Wilson 95 %", "with measured vision", "Wilson 95 %"]
    header += ["difference [points]", "jitter of a point, cameras", "measured vision", "prediction error, cameras"]
    return [*header, "measured vision"], lines


def race(turns):
    """Returns {(estimator, name): processor time [s] of each turn}, with cameras and measured vision in turns.

    It is processor time, because other programs on the machine affect wall time; one thread each.
    """
    from pydrake.systems.analysis import Simulator

    from drake_tracker import load_scenario, make_diagram

    simulators = {}
    for estimator in ("arc_length", "closed_path"):
        for name, overrides in (("cameras", []), ("measured", [MEASURED])):
            overrides = [f"estimator={ESTIMATORS[estimator]}", "grasp.settle_time=60", *overrides]
            simulators[estimator, name] = Simulator(make_diagram(load_scenario("train", overrides=overrides)))
    times = {key: [] for key in simulators}
    for turn in range(WARM_UP + turns):
        for key, simulator in simulators.items():
            start = time.process_time()
            simulator.AdvanceTo((turn + 1) * TURN)
            if turn >= WARM_UP:
                times[key].append(time.process_time() - start)
    return times


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=20, help="turns of the timing; 0: no timing")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    parser.add_argument("--json", metavar="FILE", help="also write the times to FILE")
    options = parser.parse_args()
    cameras = read_lines(CAMERAS)
    done = {key_of(row) for row in read_lines(options.results)}
    wanted = [key_of(row) for row in of_ladder(cameras) if key_of(row) not in done]
    jobs = [make_job(scenario, RUNGS[scenario], cell, seed, [MEASURED]) for scenario, cell, seed in wanted]
    append_results(run_one, jobs, options.results, options.workers, describe)
    print_table(*vision_table(pairs_of(cameras, read_lines(options.results))))
    if options.turns:
        times, results, lines = race(options.turns), {}, []
        for estimator in ("arc_length", "closed_path"):
            both = [times[estimator, name] for name in ("cameras", "measured")]
            ratio = statistics.median(a / b for a, b in zip(*both))
            results[f"times_as_fast_{estimator}"] = ratio
            per_second = [f"{statistics.median(each) / TURN:.3f}" for each in both]
            lines.append([estimator, *per_second, f"{ratio:.1f}"])
        header = ["estimator", "cameras: processor time of a simulated second [s]", "measured vision", "times as fast"]
        print_table(header, lines)
        save_json(results, options.json, [0])


if __name__ == "__main__":
    main()
