"""Maps how often the train is lifted over the lag of vision and the speed of the train.

    python benchmarks/grasp_map.py                  every cell, on all cores; resumes where it was stopped
    python benchmarks/grasp_map.py --quick          nine cells, two seeds each, into runs/
    python benchmarks/grasp_map.py --rendered       six cells with cameras, to compare with the map
    python benchmarks/grasp_map.py --draw           only the tables and the picture, from the existing results

The default oval with arc_length and closed_path, on measured vision: the error of the camera loop at each speed
(``drake-tracker measure``) with a chosen lag. No camera has a lag of 0; the estimator still reads the point a quarter
of a plant step late. Each run becomes a line of ``results/grasp_map.jsonl`` as soon as it ends.

A train counts as lifted when that happens within `time_limit`: two laps and 10 s, at least 20 s, in any attempt.
"""

import argparse
import os
from pathlib import Path

from shared import common
from shared.common import append_results, interval, print_table
from shared.stored import read_lines
from train_grasp import ESTIMATORS, outcome, run_one

from drake_tracker.campaign.plan import Lost

LAGS = (0, 6, 12, 15, 24, 30)
"""Of vision [cycles of 1/60 s]."""
SPEEDS = (0.05, 0.10, 0.15, 0.20, 0.30, 0.40, 0.50, 0.60)
"""Of the train [m/s]."""
RENDERED = ((6, 0.15), (15, 0.10), (15, 0.20), (15, 0.30), (24, 0.15), (30, 0.20))
"""Cells (lag, speed) that are run with cameras too."""
MAPPED = ("arc_length", "closed_path")
FIRST_SEED, SEEDS = 400, 30
LAP = 1.2
"""Length of the default oval [m]."""
HERE = Path(__file__).parent
RESULTS = common.RESULTS / "grasp_map.jsonl"
PICTURE = HERE.parent / "docs" / "images" / "grasp_map.png"
KEPT = (
    *("estimator", "vision", "lag_cycles", "speed", "seed", "success", "first_attempt_success", "attempts"),
    *("time_to_grasp_s", "failure_reason", "simulated_s", "wall_s", "package_versions", "git_commit"),
)


def time_limit(speed):
    """Returns the simulated time [s] after which a run at a speed [m/s] ends without success."""
    return max(20.0, 10.0 + 2.0 * LAP / speed)


def make_job(vision, estimator, lag, speed, seed):
    """Returns (key, argument of `run_one`) of one trial."""
    overrides = [
        f"vision=!{vision} {{lag_cycles: {lag}}}",
        f"estimator={ESTIMATORS[estimator]}",
        f"track.speed={speed}",
        f"duration={time_limit(speed)}",
    ]
    return (vision, estimator, lag, speed, seed), ("train", estimator, f"{vision} {lag} {speed}", seed, overrides)


def trial(keyed):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    (vision, _, lag, speed, _), job = keyed
    row = run_one(job)
    if isinstance(row, Lost):
        return row
    row = {**row, "vision": vision, "lag_cycles": lag, "speed": speed}
    return {key: row.get(key) for key in KEPT}


def key_of(row):
    return (row["vision"], row["estimator"], row["lag_cycles"], row["speed"], row["seed"])


def run_all(jobs, path, workers):
    """Runs the jobs that are not yet in the file ``path`` and appends their results."""
    done = {key_of(row) for row in read_lines(path)}
    jobs = [job for job in jobs if job[0] not in done]
    append_results(trial, jobs, path, workers, describe)


def describe(row):
    where = f"{row['estimator']}, lag {row['lag_cycles'] / 60:.2f} s, {row['speed']:g} m/s, seed {row['seed']}"
    return f"{where}: {outcome(row)}"


def rates(rows, vision, estimator):
    """Returns {(lag [cycles], speed [m/s]): (lifted, runs)}."""
    found = {}
    for row in rows:
        if (row["vision"], row["estimator"]) == (vision, estimator):
            lifted, runs = found.get((row["lag_cycles"], row["speed"]), (0, 0))
            found[row["lag_cycles"], row["speed"]] = (lifted + bool(row["success"]), runs + 1)
    return found


def rate(found, cell):
    """Returns the rate of a cell as a text: share lifted, Wilson 95 % interval; empty when the cell was not run."""
    if cell not in found:
        return ""
    lifted, runs = found[cell]
    return f"{100 * lifted / runs:.0f} % ({interval(lifted, runs).removesuffix(' %')})"


def map_table(rows, estimator):
    """Returns (header, rows) of the map of an estimator, a row per lag and a column per speed; None without runs."""
    found = rates(rows, "Measured", estimator)
    if not found:
        return None
    lags, speeds = (sorted({cell[k] for cell in found}) for k in (0, 1))
    header = ["lag [s] \\ speed [m/s]", *(f"{speed:.2f}" for speed in speeds)]
    return header, [[f"{lag / 60:.2f}", *(rate(found, (lag, speed)) for speed in speeds)] for lag in lags]


def cameras_table(rows, estimators):
    """Returns (header, rows) of the cells that were run with cameras, beside measured vision; None without any."""
    columns = [[rates(rows, vision, name) for vision in ("Measured", "Rendered")] for name in estimators]
    cells = sorted({cell for _, rendered in columns for cell in rendered})
    if not cells:
        return None
    header = [text for name in estimators for text in (f"{name}: measured vision", f"{name}: cameras")]
    lines = [
        [f"{cell[0] / 60:.2f}", f"{cell[1]:.2f}", *(rate(found, cell) for column in columns for found in column)]
        for cell in cells
    ]
    return ["lag [s]", "speed [m/s]", *header], lines


def print_maps(rows, estimators):
    """Prints the map of each estimator, and the cells that were run with cameras."""
    for estimator in estimators:
        table = map_table(rows, estimator)
        if table:
            print(f"{estimator}: trains lifted, Wilson 95 % interval")
            print_table(*table)
    table = cameras_table(rows, estimators)
    if table:
        print_table(*table)


def draw(rows, path):
    """Draws the maps side by side: share lifted as colour and number; cells that were not run stay white."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from drake_tracker.campaign.plots import draw_map
    from drake_tracker.tasks.style import PLOT_STYLE

    maps = {estimator: rates(rows, "Measured", estimator) for estimator in MAPPED}
    cells = [cell for found in maps.values() for cell in found]
    if not cells:
        return
    lags, speeds = (sorted({cell[k] for cell in cells}) for k in (0, 1))
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(14, 5.2), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(1, len(maps), sharey=True, squeeze=False)[0]
        for ax, (estimator, found) in zip(axes, maps.items()):
            shares = {(speed, lag): lifted / runs for (lag, speed), (lifted, runs) in found.items()}
            image = draw_map(ax, shares, speeds, lags)
            ax.set_yticks(range(len(lags)), [f"{lag / 60:.2f}" for lag in lags])
            ax.set(title=estimator, xlabel="speed of the train  [m/s]")
        axes[0].set_ylabel("lag of vision  [s]")
        figure.colorbar(image, ax=axes, label="trains lifted  [%]", pad=0.02)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110)
    print(f"wrote {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="nine cells, two seeds each, into runs/")
    parser.add_argument("--rendered", action="store_true", help="six cells with cameras")
    parser.add_argument("--draw", action="store_true", help="run nothing; print the tables and draw the picture")
    parser.add_argument("--estimators", default=",".join(MAPPED), help="names separated by commas")
    parser.add_argument("--seeds", type=int, help=f"runs per cell (default {SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, help="JSONL file to append to")
    options = parser.parse_args()
    estimators = options.estimators.split(",")
    unknown = [name for name in estimators if name not in ESTIMATORS]
    if unknown:
        parser.error(f"unknown estimator {unknown[0]}; there are {', '.join(ESTIMATORS)}")
    lags, speeds, seeds, results, picture = LAGS, SPEEDS, options.seeds or SEEDS, RESULTS, PICTURE
    if options.quick:
        lags, speeds, seeds = LAGS[::3], SPEEDS[1:6:2], options.seeds or 2
        results, picture = Path("runs/grasp_map.jsonl"), Path("runs/grasp_map.png")
    results = options.results or results
    if not options.draw:
        cells = RENDERED if options.rendered else [(lag, speed) for lag in lags for speed in speeds]
        vision = "Rendered" if options.rendered else "Measured"
        jobs = [  # seed by seed, so that an interrupted map covers all cells
            make_job(vision, estimator, lag, speed, seed)
            for seed in range(options.first_seed, options.first_seed + seeds)
            for lag, speed in cells
            for estimator in estimators
        ]
        run_all(jobs, results, options.workers)
    rows = read_lines(results)
    print_maps(rows, estimators)
    draw(rows, picture)


if __name__ == "__main__":
    main()
