"""Whether measured vision is a fair stand-in for cameras: how often the train is lifted with each, and how fast.

    python benchmarks/measured_vision.py [--estimators NAMES] [--first-seed N] [--turns N] [--json FILE]

The runs with cameras are those of ``results/train_grasp.jsonl``, on the plain train in plain light, from the first seed
of its table on; each is repeated with measured vision, the same estimator, track, speed and seed. Those runs go to
``results/measured_vision.jsonl`` line by line, and are not run twice. For the speed, both take turns in the same run,
simulated second by simulated second.
"""

import argparse
import os
import statistics
import time
from pathlib import Path

from common import append_results, print_table, save_json
from train_grasp import CELLS, ESTIMATORS, FIRST_SEED, TRACKS, outcome, run_one

from drake_tracker.campaign.record import read_lines
from drake_tracker.campaign.trial import Lost
from drake_tracker.campaign.wilson import wilson

HERE = Path(__file__).parent
CAMERAS = HERE / "results" / "train_grasp.jsonl"
RESULTS = HERE / "results" / "measured_vision.jsonl"
MEASURED = "vision=!Measured {}"
TURN, WARM_UP = 1.0, 3
"""Simulated time [s] of each turn of the race, and turns that do not count."""
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
    """Runs what is not yet in the file ``path`` with measured vision, and appends it there."""
    done = {key_of(row) for row in read_lines(path)}
    jobs = [
        (estimator, cell, seed, [MEASURED, f"estimator={ESTIMATORS[estimator]}", *CELLS[cell]])
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
    """Prints the rates side by side, per cell and in all; returns them as a list of dicts."""
    pairs = {key_of(row): [row] for row in cameras}
    for row in measured:
        if key_of(row) in pairs:
            pairs[key_of(row)].append(row)
    pairs = {key: pair for key, pair in pairs.items() if len(pair) == 2}
    groups = {}
    for estimator, cell, seed in sorted(pairs):
        groups.setdefault((estimator, cell), []).append(pairs[estimator, cell, seed])
        groups.setdefault((estimator, "all"), []).append(pairs[estimator, cell, seed])
    found, lines = [], []
    for (estimator, cell), runs in groups.items():
        entry = {"estimator": estimator, "cell": cell, "runs": len(runs)}
        shown = []
        for name, column in (("cameras", [a for a, _ in runs]), ("measured", [b for _, b in runs])):
            for what in ("success", "first_attempt_success"):
                count = sum(bool(row[what]) for row in column)
                low, high = wilson(count, len(runs))
                entry[f"{name}_{what}"] = [count / len(runs), low, high]
                shown.append(f"{100 * count / len(runs):.0f} % ({100 * low:.0f}-{100 * high:.0f})")
            for what in ("prediction_rms_m", "triangulation_rms_m", "triangulation_jitter_m"):
                values = [row[what] for row in column if row.get(what) is not None]
                entry[f"{name}_{what}"] = statistics.median(values) if values else None
        points = 100 * (entry["measured_success"][0] - entry["cameras_success"][0])
        entry["difference_points"] = points
        found.append(entry)
        lines.append([estimator, cell, len(runs), shown[0], shown[2], f"{points:+.0f}", shown[1], shown[3]])
    header = ["estimator", "cell", "runs", "cameras: lifted", "measured: lifted", "difference [points]"]
    print_table([*header, "cameras: first attempt", "measured: first attempt"], lines)
    for entry in found:
        if entry["cell"] == "all":
            for what in ("prediction_rms_m", "triangulation_rms_m", "triangulation_jitter_m"):
                a, b = (entry[f"{name}_{what}"] for name in ("cameras", "measured"))
                if a is not None and b is not None:
                    print(f"{entry['estimator']}: median {what}: cameras {1e3 * a:.2f} mm, measured {1e3 * b:.2f} mm")
    return found


def race(turns):
    """Returns {(estimator, name): processor time [s] of each turn}, with cameras and measured vision in turns.

    Processor time, since other work on the machine stretches wall time by what nobody knows; one thread each.
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
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="earlier seeds are left out (0: none is)")
    parser.add_argument("--limit", type=int, help="at most so many runs of each estimator")
    parser.add_argument("--turns", type=int, default=20, help="of the race; 0: no race")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    plain = {f"{track}-{speed:.2f}" for track in TRACKS for speed in (0.10, 0.15, 0.20)}
    cameras = []
    for name in options.estimators.split(","):
        own = [row for row in read_lines(CAMERAS) if row["estimator"] == name and row["cell"] in plain]
        cameras += [row for row in own if row["seed"] >= options.first_seed][: options.limit]
    options.results.parent.mkdir(parents=True, exist_ok=True)
    run_all([key_of(row) for row in cameras], options.results, options.workers)
    results = {"rates": compare(cameras, read_lines(options.results))}
    if options.turns:
        times = race(options.turns)
        lines = []
        for estimator in ("arc_length", "closed_path"):
            cameras, measured = times[estimator, "cameras"], times[estimator, "measured"]
            ratio = statistics.median(a / b for a, b in zip(cameras, measured))
            results[f"times_as_fast_{estimator}"] = ratio
            per_second = [f"{statistics.median(each) / TURN:.3f}" for each in (cameras, measured)]
            lines.append([estimator, *per_second, f"{ratio:.1f}"])
        header = ["estimator", "cameras: processor time of a simulated second [s]", "measured vision", "times as fast"]
        print_table(header, lines)
    save_json(results, options.json)


if __name__ == "__main__":
    main()
