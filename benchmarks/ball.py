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
from drake_tracker.tasks import load_scenario

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


def known(rows, name):
    """Returns the values of those rows that have one: a run that broke off or never saw the ball roll has none."""
    return [row[name] for row in rows if row.get(name) is not None]


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def print_results(rows, cells):
    lines = []
    for cell in cells:
        runs = [row for row in rows if row["cell"] == cell]
        if not runs:
            continue
        caught = sum(bool(row["success"]) for row in runs)
        low, high = wilson(caught, len(runs))
        hand = [abs(error) for error in known(runs, "hand_error_m")]
        foreseen = [abs(error) for error in known(known(runs, "crossing_error_m"), "0.25")]
        lines.append(
            [
                cell,
                len(runs),
                f"{caught} ({100 * caught / len(runs):.0f} %)",
                f"{100 * low:.0f}-{100 * high:.0f} %",
                f"{1e3 * statistics.median(hand):.0f} mm" if hand else "",
                f"{1e3 * statistics.median(foreseen):.0f} mm" if foreseen else "",
                f"{1e3 * rms(known(runs, 'position_rms_m')):.1f} mm",
            ]
        )
    header = ["cell", "runs", "caught", "Wilson 95 %", "hand off, median", "foreseen 0.25 s before", "seen, rms"]
    print_table(header, lines)
    found = [row for row in rows if row["cell"] in cells and row.get("board_in_camera_error")]
    for name in ("board_in_camera_error", "board_in_world_error"):
        place, turn = (rms([row[name][k] for row in found]) for k in (0, 1))
        print(f"{name}: {1e3 * place:.2f} mm, {math.degrees(turn):.3f} deg rms over {len(found)} initialisations")
    seen = [row for row in rows if row["cell"] in cells and "board_touched" in row]
    if known(seen, "vision_valid_fraction"):
        believed = statistics.median(known(seen, "vision_valid_fraction"))
        print(f"readings believed while the ball rolls, median of the runs: {100 * believed:.0f} %")
        print(f"board touched by the arm: in {sum(bool(row['board_touched']) for row in seen)} of {len(seen)} runs")
    for cell in cells:
        runs = [row for row in seen if row["cell"] == cell]
        if runs:
            found = known(runs, "lag_s")
            lags = ", ".join(sorted({f"{1e3 * lag[end]:.2f} ms" for lag in found for end in ("min", "max")}))
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
