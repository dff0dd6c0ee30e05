"""Measures how often the train is lifted, with rendered images in the loop.

    python benchmarks/train_grasp.py                            every cell, all seeds, all cores; resumes
    python benchmarks/train_grasp.py --estimator arc_length     the same with another estimator
    python benchmarks/train_grasp.py --estimator all --seeds 3  all estimators side by side
    python benchmarks/train_grasp.py --cells cast-shadows       a cell that takes hours and runs only by name

Each run becomes a line of ``results/train_grasp.jsonl`` as soon as it ends. The printed table covers the seeds asked
for, by default 500 to 519. Constants were chosen on seeds below 200. Failures on seeds 200 to 219 (the filter of 1991)
and 300 to 319 (the default estimator) were examined and led to changes.
"""

import argparse
import os
import statistics
from pathlib import Path

import common
from common import append_results, interval, print_table, share

from drake_tracker.campaign.record import read_lines
from drake_tracker.campaign.trial import run_line
from drake_tracker.tasks import load_scenario

FIRST_SEED = 500
SEEDS = 20
RESULTS = common.RESULTS / "train_grasp.jsonl"
ESTIMATORS = {
    "alpha_beta_gamma": "!AlphaBetaGamma {}",
    "arc_length": "!ArcLength {}",
    "coordinated_turn": "!CoordinatedTurn {}",
    "closed_path": "!ClosedPath {}",
}
TRACKS = ("oval", "stadium", "circle", "figure_eight")
CELLS = {  # name: overrides
    **{
        f"{track}-{speed:.2f}": [f"track.kind={track}", f"track.speed={speed}"]
        for track in TRACKS
        for speed in (0.10, 0.15, 0.20)
    },
    "striped": ["train.body=striped"],
    "round": ["train.body=round"],
    "one-sided-light": ["lighting.side=one_side"],
    "flicker-5%": ["lighting.flicker=0.05"],
    "varying-speed": ["track.speed_law=varying"],
    "line": [],
    "cast-shadows-gated": ["lighting.shadows=true", "vision.detector.brightness_gate=true"],
    "cast-shadows": ["lighting.shadows=true"],
}
SCENARIOS = {"line": "train:line"}
"""Cells with a scenario other than "train"."""
BY_NAME = ("cast-shadows-gated", "cast-shadows")
"""Cells that run only when asked for: rendering their images takes four times as long."""


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    estimator, cell, seed, overrides = job
    return run_line(
        load_scenario(SCENARIOS.get(cell, "train"), seed=seed, overrides=overrides), estimator=estimator, cell=cell
    )


def outcome(row):
    """Returns the outcome of a run as a text."""
    return "lifted" if row["success"] else f"not lifted: {row.get('failure_reason')}"


def median_time(runs):
    """Returns the median time to grasp of the runs that lifted the train, as a text."""
    times = [row["time_to_grasp_s"] for row in runs if row.get("time_to_grasp_s") is not None]
    return f"{statistics.median(times):.1f} s" if times else ""


def lifted(runs):
    """Returns how many of the runs lifted the train, and how many of them at the first attempt."""
    return sum(bool(row["success"]) for row in runs), sum(bool(row.get("first_attempt_success")) for row in runs)


def cells_table(rows):
    """Returns (header, rows) of the table of one estimator, one row per cell."""
    lines = []
    for cell in dict.fromkeys(row["cell"] for row in rows):
        runs = [row for row in rows if row["cell"] == cell]
        total, first = lifted(runs)
        lines.append([cell, len(runs), *share(total, len(runs)), *share(first, len(runs)), median_time(runs)])
    return ["cell", "runs", "lifted", "Wilson 95 %", "first attempt", "Wilson 95 %", "median time to grasp"], lines


def side_by_side_table(rows, estimators):
    """Returns (header, rows) of a table with a column for each estimator: lifted at the first attempt, median time."""

    def shown(runs):
        total, first = lifted(runs)
        later = f" ({total} in the end)" if total > first else ""
        when = f", {median_time(runs)}" if total else ""
        return f"{first} of {len(runs)}{later}{when}" if runs else ""

    columns = [[row for row in rows if row["estimator"] == name] for name in estimators]
    lines = [
        [cell, *(shown([row for row in column if row["cell"] == cell]) for column in columns)]
        for cell in dict.fromkeys(row["cell"] for row in rows)
    ]
    lines.append(["all", *(shown(column) for column in columns)])
    lines.append(["Wilson 95 %", *(interval(lifted(column)[1], len(column)) if column else "" for column in columns)])
    return ["first attempt, median time", *estimators], lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--estimator", choices=[*ESTIMATORS, "all"], default="closed_path")
    parser.add_argument("--cells", help=f"names separated by commas (default: all except {' and '.join(BY_NAME)})")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"runs per cell (default {SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--set", action="append", default=[], dest="overrides", help="KEY=VALUE for every run")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    names = options.cells.split(",") if options.cells else [name for name in CELLS if name not in BY_NAME]
    unknown = [name for name in names if name not in CELLS]
    if unknown:
        parser.error(f"unknown cell {unknown[0]}; there are {', '.join(CELLS)}")

    estimators = list(ESTIMATORS) if options.estimator == "all" else [options.estimator]
    done = {(row["estimator"], row["cell"], row["seed"]) for row in read_lines(options.results)}
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    jobs = [
        (estimator, name, seed, [f"estimator={ESTIMATORS[estimator]}", *CELLS[name], *options.overrides])
        for seed in seeds
        for estimator in estimators
        for name in names
        if (estimator, name, seed) not in done
    ]
    append_results(
        run_one,
        jobs,
        options.results,
        options.workers,
        lambda row: f"{row['estimator']} {row['cell']} seed {row['seed']}: {outcome(row)}",
    )
    rows = [
        row
        for row in read_lines(options.results)
        if row["estimator"] in estimators and row["cell"] in names and row["seed"] in seeds
    ]
    rows.sort(key=lambda row: (names.index(row["cell"]), row["seed"]))
    if options.estimator == "all":
        print_table(*side_by_side_table(rows, estimators))
    else:
        print_table(*cells_table(rows))
    for row in rows:
        if not row["success"]:
            print(f"failed: {row['estimator']} {row['cell']} seed {row['seed']}: {row.get('failure_reason')}")


if __name__ == "__main__":
    main()
