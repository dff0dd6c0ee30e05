"""Compares measured vision with cameras: how often the train is lifted with each, and the processor time of each.

    python benchmarks/measured_vision.py [--estimators NAMES] [--first-seed N] [--turns N] [--json FILE]

The runs with cameras are those of ``results/train_grasp.jsonl`` with the plain train in plain light, from seed 500 on
(``--first-seed``). Each is repeated with measured vision and the same estimator, track, speed and seed; these runs go
to ``results/measured_vision.jsonl`` and are not repeated. For the processor time, both kinds of vision take turns in
one process, one simulated second at a time.
"""

import argparse
import os
import statistics
import time
from pathlib import Path

from shared import common
from shared.common import append_results, print_table, save_json
from shared.stored import read_lines
from train_grasp import CELLS, ESTIMATORS, TRACKS, outcome, run_one

from drake_tracker.campaign.plan import Lost
from drake_tracker.campaign.rates import wilson

CAMERAS = common.RESULTS / "train_grasp.jsonl"
RESULTS = common.RESULTS / "measured_vision.jsonl"
MEASURED = "vision=!Measured {}"
PLAIN = [f"{track}-{speed:.2f}" for track in TRACKS for speed in (0.10, 0.15, 0.20)]
"""Cells with the plain train in plain light."""
FIRST_SEED, LAST_SEED = 500, 999
"""Seeds of the runs with cameras that are repeated. Later seeds are those of the ladder."""
TURN, WARM_UP = 1.0, 3
"""Simulated time [s] of each turn of the timing, and turns that do not count."""
MEDIANS = ("prediction_rms_m", "triangulation_rms_m", "triangulation_jitter_m")
KEPT = (
    *("estimator", "cell", "seed", "success", "first_attempt_success", "attempts", "time_to_grasp_s"),
    *("failure_reason", "prediction_rms_m", "triangulation_rms_m", "triangulation_jitter_m", "simulated_s", "wall_s"),
    *("package_versions", "git_commit"),
)


def key_of(row):
    return row["estimator"], row["cell"], row["seed"]


def trial(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    row = run_one(job)
    return row if isinstance(row, Lost) else {key: row.get(key) for key in KEPT}


def run_all(keys, path, workers):
    """Runs the keys that are not yet in the file ``path`` with measured vision and appends their results."""
    done = {key_of(row) for row in read_lines(path)}
    jobs = [
        ("train", estimator, cell, seed, [MEASURED, f"estimator={ESTIMATORS[estimator]}", *CELLS[cell]])
        for estimator, cell, seed in keys
        if (estimator, cell, seed) not in done
    ]
    append_results(
        trial,
        jobs,
        path,
        workers,
        lambda row: f"{row['estimator']} {row['cell']} seed {row['seed']}: {outcome(row)}",
    )


def compare(cameras, measured):
    """Returns a list of dicts, one per estimator and cell (and "all"): rates and medians of both kinds of vision.

    Only runs that exist with both kinds of vision count.
    """
    pairs = {key_of(row): [row] for row in cameras}
    for row in measured:
        if key_of(row) in pairs:
            pairs[key_of(row)].append(row)
    pairs = {key: pair for key, pair in pairs.items() if len(pair) == 2}
    groups = {}
    for estimator, cell, seed in sorted(pairs):
        groups.setdefault((estimator, cell), []).append(pairs[estimator, cell, seed])
        groups.setdefault((estimator, "all"), []).append(pairs[estimator, cell, seed])
    found = []
    for (estimator, cell), runs in groups.items():
        entry = {"estimator": estimator, "cell": cell, "runs": len(runs)}
        for name, column in (("cameras", [a for a, _ in runs]), ("measured", [b for _, b in runs])):
            for what in ("success", "first_attempt_success"):
                count = sum(bool(row[what]) for row in column)
                entry[f"{name}_{what}"] = [count / len(runs), *wilson(count, len(runs))]
                entry[f"{name}_{what}_count"] = count
            for what in MEDIANS:
                values = [row[what] for row in column if row.get(what) is not None]
                entry[f"{name}_{what}"] = statistics.median(values) if values else None
        entry["difference_points"] = 100 * (entry["measured_success"][0] - entry["cameras_success"][0])
        found.append(entry)
    return found


def cells_table(found):
    """Returns (header, rows) of what `compare` returned, one row per estimator and cell."""
    lines = []
    for entry in found:
        rates = {
            f"{name}_{what}": "{:.0f} % ({:.0f}-{:.0f})".format(*(100 * value for value in entry[f"{name}_{what}"]))
            for name in ("cameras", "measured")
            for what in ("success", "first_attempt_success")
        }
        lifted = [rates["cameras_success"], rates["measured_success"], f"{entry['difference_points']:+.0f}"]
        first = [rates["cameras_first_attempt_success"], rates["measured_first_attempt_success"]]
        lines.append([entry["estimator"], entry["cell"], entry["runs"], *lifted, *first])
    header = ["estimator", "cell", "runs", "cameras: lifted", "measured: lifted", "difference [points]"]
    return [*header, "cameras: first attempt", "measured: first attempt"], lines


def print_comparison(found):
    """Prints the rates per cell, and the medians over all cells of an estimator."""
    print_table(*cells_table(found))
    for entry in found:
        if entry["cell"] == "all":
            for what in MEDIANS:
                a, b = (entry[f"{name}_{what}"] for name in ("cameras", "measured"))
                if a is not None and b is not None:
                    print(f"{entry['estimator']}: median {what}: cameras {1e3 * a:.2f} mm, measured {1e3 * b:.2f} mm")


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
    parser.add_argument("--estimators", default=",".join(ESTIMATORS), help="names separated by commas")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="leave out earlier seeds (default 500)")
    parser.add_argument("--limit", type=int, help="largest number of runs per estimator")
    parser.add_argument("--turns", type=int, default=20, help="turns of the timing; 0: no timing")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    parser.add_argument("--json", metavar="FILE", help="also write rates and times to FILE")
    options = parser.parse_args()
    cameras = []
    for name in options.estimators.split(","):
        own = [row for row in read_lines(CAMERAS) if row["estimator"] == name and row["cell"] in PLAIN]
        cameras += [row for row in own if options.first_seed <= row["seed"] <= LAST_SEED][: options.limit]
    options.results.parent.mkdir(parents=True, exist_ok=True)
    run_all([key_of(row) for row in cameras], options.results, options.workers)
    found = compare(cameras, read_lines(options.results))
    print_comparison(found)
    results = {"rates": found}
    seeds = sorted({row["seed"] for row in cameras})
    if options.turns:
        times = race(options.turns)
        lines = []
        for estimator in ("arc_length", "closed_path"):
            both = [times[estimator, name] for name in ("cameras", "measured")]
            ratio = statistics.median(a / b for a, b in zip(*both))
            results[f"times_as_fast_{estimator}"] = ratio
            per_second = [f"{statistics.median(each) / TURN:.3f}" for each in both]
            lines.append([estimator, *per_second, f"{ratio:.1f}"])
        header = ["estimator", "cameras: processor time of a simulated second [s]", "measured vision", "times as fast"]
        print_table(header, lines)
    save_json(results, options.json, seeds)


if __name__ == "__main__":
    main()
