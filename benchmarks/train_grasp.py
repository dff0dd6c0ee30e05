"""How often the train is lifted, with rendered images in the loop: the tables of the README.

    python benchmarks/train_grasp.py                            every cell, all seeds, all cores; goes on where it was
    python benchmarks/train_grasp.py --estimator arc_length     the same with another estimator
    python benchmarks/train_grasp.py --cells oval-0.15 --seeds 3

Each run is a line of ``results/train_grasp.jsonl`` as soon as it ends; the table is of the seeds asked for, 500 and up
where nothing else is said. Constants were chosen on seeds below 200; of seeds 200 to 219 (the filter of 1991) and 300
to 319 (the default one) failures were looked at and led to changes.
"""

import argparse
import os
import statistics
from pathlib import Path

from common import append_results

from drake_tracker.campaign.record import read_lines
from drake_tracker.campaign.trial import run_line
from drake_tracker.campaign.wilson import wilson
from drake_tracker.scenarios import load_scenario

FIRST_SEED = 500
SEEDS = 20
RESULTS = Path(__file__).parent / "results" / "train_grasp.jsonl"
ESTIMATORS = {
    "closed_path": "!ClosedPath {}",
    "coordinated_turn": "!CoordinatedTurn {}",
    "arc_length": "!ArcLength {}",
    "alpha_beta_gamma": "!AlphaBetaGamma {}",
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
    "cast-shadows-gated": ["lighting.shadows=true", "vision.detector.brightness_gate=true"],
    "cast-shadows": ["lighting.shadows=true"],
}


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    estimator, cell, seed, overrides = job
    return run_line(load_scenario("train", seed=seed, overrides=overrides), estimator=estimator, cell=cell)


def outcome(row):
    """Returns in words what came of a run."""
    return "lifted" if row["success"] else f"not lifted: {row.get('failure_reason')}"


def print_table(rows):
    header = "| cell | runs | lifted | Wilson 95 % | first attempt | Wilson 95 % | median time to grasp |"
    print(header, "|---|---|---|---|---|---|---|", sep="\n")
    for cell in dict.fromkeys(row["cell"] for row in rows):
        runs = [row for row in rows if row["cell"] == cell]
        lifted = sum(bool(row["success"]) for row in runs)
        first = sum(bool(row.get("first_attempt_success")) for row in runs)
        (a, b), (c, d) = wilson(lifted, len(runs)), wilson(first, len(runs))
        times = [row["time_to_grasp_s"] for row in runs if row.get("time_to_grasp_s") is not None]
        seconds = f"{statistics.median(times):.1f} s" if times else ""
        print(
            f"| {cell} | {len(runs)} | {lifted} ({100 * lifted / len(runs):.0f} %) | {100 * a:.0f}-{100 * b:.0f} % "
            f"| {first} ({100 * first / len(runs):.0f} %) | {100 * c:.0f}-{100 * d:.0f} % | {seconds} |"
        )
    failures = [row for row in rows if not row["success"]]
    for row in failures:
        print(f"failed: {row['cell']} seed {row['seed']}: {row.get('failure_reason')}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--estimator", choices=ESTIMATORS, default="closed_path")
    parser.add_argument("--cells", default="all", help="names separated by commas")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="trials a cell")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--set", action="append", default=[], dest="overrides", help="KEY=VALUE for every run")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    names = list(CELLS) if options.cells == "all" else options.cells.split(",")
    unknown = [name for name in names if name not in CELLS]
    if unknown:
        parser.error(f"unknown cell {unknown[0]}; there are {', '.join(CELLS)}")

    estimator = options.estimator
    done = {(row["estimator"], row["cell"], row["seed"]) for row in read_lines(options.results)}
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    jobs = [
        (estimator, name, seed, [f"estimator={ESTIMATORS[estimator]}", *CELLS[name], *options.overrides])
        for seed in seeds
        for name in names
        if (estimator, name, seed) not in done
    ]
    append_results(
        run_one, jobs, options.results, options.workers, lambda row: f"{row['cell']} seed {row['seed']}: {outcome(row)}"
    )
    rows = [
        row
        for row in read_lines(options.results)
        if row["estimator"] == estimator and row["cell"] in names and row["seed"] in seeds
    ]
    print_table(sorted(rows, key=lambda row: (names.index(row["cell"]), row["seed"])))


if __name__ == "__main__":
    main()
