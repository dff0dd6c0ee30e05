"""How often the ball is caught, with rendered images in the loop: the numbers of the NIST task.

    python benchmarks/ball.py                    both arms 100 releases each, the other cells 20, on all cores
    python benchmarks/ball.py --cells puma --seeds 10

Each run is a line of ``results/ball.jsonl`` as soon as it ends, and is not run again. Everything is drawn from the
seed: start, pegs, the board's place, the camera's, what the operator misses, noise. Seeds 1000 and up are for these
numbers; constants were chosen on seeds below 200. Every run finds the board by itself, by camera and by touch; the
errors of these poses are printed too.
"""

import argparse
import math
import os
import statistics
from pathlib import Path

from common import append_results, print_table

from drake_tracker.campaign.record import read_lines
from drake_tracker.campaign.trial import run_line
from drake_tracker.campaign.wilson import wilson
from drake_tracker.scenarios import load_scenario

RESULTS = Path(__file__).parent / "results" / "ball.jsonl"
FIRST_SEED = 1000
CELLS = {  # name: scenario, overrides, releases
    "puma": ("ball", [], 100),
    "seven_joint": ("ball:seven_joint", [], 100),
    "stays in the middle": ("ball", ["catch.follow=false"], 20),
    "every image": ("ball:every_image", [], 20),
}


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    cell, seed, scenario, overrides = job
    return run_line(load_scenario(scenario, seed=seed, overrides=overrides), cell=cell)


def rms(values):
    values = [value for value in values if value is not None]
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def print_results(rows, cells):
    lines = []
    for cell in cells:
        runs = [row for row in rows if row["cell"] == cell]
        if not runs:
            continue
        caught = sum(bool(row["success"]) for row in runs)
        low, high = wilson(caught, len(runs))
        hand = [abs(row["hand_error_m"]) for row in runs if row.get("hand_error_m") is not None]
        foreseen = [(row.get("crossing_error_m") or {}).get("0.25") for row in runs]
        foreseen = [error for error in foreseen if error is not None]
        lines.append([
            cell, len(runs), f"{caught} ({100 * caught / len(runs):.0f} %)", f"{100 * low:.0f}-{100 * high:.0f} %",
            f"{1e3 * statistics.median(hand):.0f} mm" if hand else "",
            f"{1e3 * statistics.median(map(abs, foreseen)):.0f} mm" if foreseen else "",
            f"{1e3 * rms(row.get('position_rms_m') for row in runs):.1f} mm",
        ])
    header = ["cell", "runs", "caught", "Wilson 95 %", "hand off, median", "foreseen 0.25 s before", "seen, rms"]
    print_table(header, lines)
    found = [row for row in rows if row["cell"] in cells and row.get("board_in_camera_error")]
    for name in ("board_in_camera_error", "board_in_world_error"):
        place, turn = (rms(row[name][k] for row in found) for k in (0, 1))
        print(f"{name}: {1e3 * place:.2f} mm, {math.degrees(turn):.3f} deg rms over {len(found)} initialisations")
    seen = [row for row in rows if row["cell"] in cells]
    if seen:
        believed = statistics.median(row["vision_valid_fraction"] for row in seen)
        print(f"readings believed while the ball rolls, median of the runs: {100 * believed:.0f} %")
        print(f"board touched by the arm: in {sum(bool(row['board_touched']) for row in seen)} of {len(seen)} runs")
    for cell in cells:
        runs = [row for row in seen if row["cell"] == cell]
        if runs:
            lags = ", ".join(sorted({f"{1e3 * row['lag_s'][end]:.2f} ms" for row in runs for end in ("min", "max")}))
            held = 1e3 * max(row["longest_saturation_s"] for row in runs)
            print(f"{cell}: {lags} from stamp to prediction; no drive saturated for over {held:.0f} ms")
    for row in rows:
        if row["cell"] in cells and not row["success"]:
            print(f"not caught: {row['cell']} seed {row['seed']}: {row.get('failure_reason')}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", default=",".join(CELLS), help="names separated by commas (default: all)")
    parser.add_argument("--seeds", type=int, help="releases a cell (default: 100 of each arm, 20 of the others)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--set", action="append", default=[], dest="overrides", help="KEY=VALUE for every run")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--results", type=Path, default=RESULTS)
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
