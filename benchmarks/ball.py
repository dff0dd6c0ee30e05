"""Measures how often the ball is caught, with rendered images in the loop.

    python benchmarks/ball.py                    61 releases with each arm, 20 of the other cells, on all cores
    python benchmarks/ball.py --cells puma --seeds 10

Each run becomes a line of ``results/ball.jsonl`` as soon as it ends and is not repeated. The seed draws the start, the
pegs, the poses of board and camera, the operator's placement error and all noise. Seeds from 1000 on are reserved for
these numbers; constants were chosen on seeds below 200. Every run locates the board itself, by camera and by touch; the
errors of these two poses are printed as well.
"""

import argparse
import math
import os
import statistics
from pathlib import Path

from shared import common
from shared.common import append_results, print_table, rms, share
from shared.stored import read_lines

from drake_tracker.campaign.plan import run_line
from drake_tracker.tasks import load_scenario

RESULTS = common.RESULTS / "ball.jsonl"
FIRST_SEED = 1000
CELLS = {  # name: scenario, overrides, releases
    "puma": ("ball", [], 61),
    "seven_joint": ("ball:seven_joint", [], 61),
    "stays in the middle": ("ball", ["catch.follow=false"], 20),
    "every image": ("ball:every_image", [], 20),
}


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    cell, seed, scenario, overrides = job
    return run_line(load_scenario(scenario, seed=seed, overrides=overrides), cell=cell)


def known(rows, name):
    """Returns the values of the rows that have one: a run that broke off, or never saw the ball roll, has none."""
    return [row[name] for row in rows if row.get(name) is not None]


def cells_table(rows, cells):
    """Returns (header, rows): catches per cell, the cup's error, the prediction's error, the measured position's."""
    lines = []
    for cell in cells:
        runs = [row for row in rows if row["cell"] == cell]
        if not runs:
            continue
        caught = sum(bool(row["success"]) for row in runs)
        cup = [abs(error) for error in known(runs, "hand_error_m")]
        predicted = [abs(error) for error in known(known(runs, "crossing_error_m"), "0.25")]
        lines.append(
            [
                cell,
                len(runs),
                *share(caught, len(runs)),
                f"{1e3 * statistics.median(cup):.0f} mm" if cup else "",
                f"{1e3 * statistics.median(predicted):.0f} mm" if predicted else "",
                f"{1e3 * rms(known(runs, 'position_rms_m')):.1f} mm",
            ]
        )
    header = ["cell", "runs", "caught", "Wilson 95 %", "error of the cup, median"]
    return [*header, "error of the crossing predicted 0.25 s ahead, median", "error of the ball's position, rms"], lines


def board_pose_errors(rows):
    """Returns {field: (position [mm], rotation [deg], runs)}: rms errors of the board's pose by camera and by touch."""
    found = [row for row in rows if row.get("board_in_camera_error")]
    poses = {}
    for name in ("board_in_camera_error", "board_in_world_error"):
        position, rotation = (rms([row[name][k] for row in found]) for k in (0, 1))
        poses[name] = 1e3 * position, math.degrees(rotation), len(found)
    return poses


def lags(rows):
    """Returns the different times [ms] from a measurement's stamp to the prediction built on it, rounded to 0.01 ms."""
    return sorted({round(1e3 * lag[end], 2) for lag in known(rows, "lag_s") for end in ("min", "max")})


def print_results(rows, cells):
    rows = [row for row in rows if row["cell"] in cells]
    print_table(*cells_table(rows, cells))
    for name, (position, rotation, runs) in board_pose_errors(rows).items():
        print(f"{name}: {position:.2f} mm, {rotation:.3f} deg rms over {runs} initialisations")
    seen = [row for row in rows if "board_touched" in row]
    if known(seen, "vision_valid_fraction"):
        accepted = statistics.median(known(seen, "vision_valid_fraction"))
        print(f"measurements accepted while the ball rolls, median of the runs: {100 * accepted:.0f} %")
        print(f"board touched by the arm: in {sum(bool(row['board_touched']) for row in seen)} of {len(seen)} runs")
    for cell in cells:
        runs = [row for row in seen if row["cell"] == cell]
        if runs:
            values = ", ".join(f"{lag:.2f} ms" for lag in lags(runs))
            longest = 1e3 * max(row["longest_saturation_s"] for row in runs)
            print(f"{cell}: {values} from stamp to prediction; longest saturation of a drive {longest:.0f} ms")
    for row in rows:
        if not row["success"]:
            print(f"not caught: {row['cell']} seed {row['seed']}: {row.get('failure_reason')}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", default=",".join(CELLS), help="names separated by commas (default: all)")
    parser.add_argument("--seeds", type=int, help="releases per cell (default: 61 with each arm, 20 of the others)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--set", action="append", default=[], dest="overrides", help="KEY=VALUE for every run")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    cells = options.cells.split(",")
    unknown = [cell for cell in cells if cell not in CELLS]
    if unknown:
        parser.error(f"unknown cell {unknown[0]}; there are {', '.join(CELLS)}")
    count = {cell: options.seeds or CELLS[cell][2] for cell in cells}
    done = {(row["cell"], row["seed"]) for row in read_lines(options.results)}
    jobs = [
        (cell, options.first_seed + k, CELLS[cell][0], [*CELLS[cell][1], *options.overrides])
        for k in range(max(count.values()))
        for cell in cells
        if k < count[cell] and (cell, options.first_seed + k) not in done
    ]

    def describe(row):
        outcome = "caught" if row["success"] else f"not caught: {row.get('failure_reason')}"
        return f"{row['cell']} seed {row['seed']}: {outcome}"

    append_results(run_one, jobs, options.results, options.workers, describe)
    print_results(read_lines(options.results), cells)


if __name__ == "__main__":
    main()
