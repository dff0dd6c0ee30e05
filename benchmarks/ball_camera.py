"""Measures from which poses the camera of the ball works: localisation of the board, and catches.

    python benchmarks/ball_camera.py                 every cell, on all cores; resumes
    python benchmarks/ball_camera.py --cells roll    one cell

In each cell one range of the camera's pose is widened, or all of them; the other ranges are those of the scenario. A
pose is drawn from the seed until the whole board is in view and no wall hides a circle, as in every run.

- locate: the camera takes its images, and the board is found in them. A board is found wrongly when its origin is more
  than 10 mm, or its axes more than 1 deg, from the truth. The table has a row for each bin of the widened quantity.
- catch: whole runs with a cell's ranges. The board is located in each of them.

Each result is a line of ``results/ball_camera.jsonl``. Seeds from 2100 on are used nowhere else.
"""

import argparse
import math
import os
import statistics
from pathlib import Path

import numpy as np
from shared import common
from shared.common import append_results, print_table, share
from shared.stored import read_lines

from drake_tracker.cameras.boards.board_poses import pose_error
from drake_tracker.campaign.plan import run_line
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.ball.initialisation import find_board, make_touching_diagram, photograph_board
from drake_tracker.world.ball.ball_board import face_corners
from drake_tracker.world.ball.ball_camera import NAME
from drake_tracker.world.imaging.cameras import camera_pose

RESULTS = common.RESULTS / "ball_camera.jsonl"
FIRST_SEED = 2100
WRONG_POSITION, WRONG_ROTATION = 0.010, math.radians(1.0)
"""A board that is found farther [m], [rad] from the truth is found wrongly."""
RANGES = {  # name: (override, edges of the bins)
    "distance": ("camera.distance_range=[0.9,4.0]", (0.9, 1.5, 1.9, 2.3, 2.7, 3.1, 3.5, 4.0)),
    "azimuth": ("camera.azimuth_range_deg=180", (0.0, 50.0, 90.0, 130.0, 180.0)),
    "elevation": ("camera.elevation_range_deg=[10,85]", (10.0, 20.0, 30.0, 40.0, 65.0, 75.0, 85.0)),
    "roll": ("camera.roll_range_deg=180", (0.0, 5.0, 45.0, 90.0, 135.0, 180.0)),
}
UNITS = {"distance": "m", "azimuth": "deg", "elevation": "deg", "roll": "deg"}
EVERYTHING = [override for override, _ in RANGES.values()]
LOCATE = {  # cell: overrides
    "as in the scenario": [],
    **{name: [override] for name, (override, _) in RANGES.items()},
    "all": EVERYTHING,
}
CATCH = dict(LOCATE)
LOCATE_SEEDS, CATCH_SEEDS = 50, 8


def pose_of(X_WC, look_at):
    """Returns (distance [m], azimuth, elevation, roll [deg]) of a camera that looks at a point, shape (3,)."""
    towards = X_WC.translation() - look_at
    distance = float(np.linalg.norm(towards))
    azimuth = math.degrees(math.atan2(towards[1], towards[0]))
    elevation = math.degrees(math.asin(towards[2] / distance))
    turn = camera_pose(azimuth, elevation, distance, look_at).rotation().inverse() @ X_WC.rotation()
    return distance, azimuth, elevation, math.degrees(math.atan2(turn.matrix()[1, 0], turn.matrix()[0, 0]))


def locate(seed, overrides):
    """Returns what becomes of the localisation of the board on one seed."""
    scenario = load_scenario("ball", seed=seed, overrides=overrides)
    touching = make_touching_diagram(scenario)
    world = touching.world
    X_WB, X_WC = world.laboratory.X_WB, world.cameras[NAME].X_WC
    look_at = X_WB @ face_corners(scenario.board).mean(axis=0)
    row = dict(zip(("distance", "azimuth", "elevation", "roll"), pose_of(X_WC, look_at)))
    try:
        _, pose = find_board(
            photograph_board(touching, touching.CreateDefaultContext()), scenario.camera, scenario.operator
        )
    except DrakeTrackerError as error:
        return {**row, "located": False, "reason": str(error)}
    position, rotation = pose_error(type(X_WB)(pose.X_CB), X_WC.inverse() @ X_WB)
    return {**row, "located": True, "position_m": position, "rotation_rad": rotation, "rms_px": float(pose.rms)}


def run_one(job):
    """Does one measurement in a worker; returns its line, or `Lost`."""
    kind, cell, seed, overrides = job
    if kind == "catch":
        return run_line(load_scenario("ball", seed=seed, overrides=overrides), kind=kind, cell=cell)
    return {"kind": kind, "cell": cell, "seed": seed, **locate(seed, overrides)}


def describe(row):
    """Returns the outcome of a measurement as a text."""
    if row["kind"] == "catch":
        said = "caught" if row["success"] else f"not caught: {row.get('failure_reason')}"
    else:
        said = f"located to {1e3 * row['position_m']:.1f} mm" if row["located"] else f"not located: {row['reason']}"
    return f"{row['kind']} {row['cell']} seed {row['seed']}: {said}"


def is_wrong(row):
    """Returns whether a located board is far from the truth."""
    return row["located"] and (row["position_m"] > WRONG_POSITION or row["rotation_rad"] > WRONG_ROTATION)


def bins(rows):
    """Yields (label, rows) of each cell of the localisation: its bins for a widened quantity, or the whole cell."""
    for cell in LOCATE:
        own = [row for row in rows if row["cell"] == cell]
        if cell not in RANGES:
            yield cell, own
            continue
        edges = RANGES[cell][1]
        for low, high in zip(edges, edges[1:]):
            yield f"{cell} {low:g} to {high:g} {UNITS[cell]}", [row for row in own if low <= abs(row[cell]) < high]


def locate_table(rows):
    """Returns (header, rows): boards located, located wrongly, and the errors of the others, by pose of the camera."""
    lines = []
    for label, own in bins([row for row in rows if row["kind"] == "locate"]):
        if not own:
            continue
        right = [row for row in own if row["located"] and not is_wrong(row)]
        wrong = sum(map(is_wrong, own))
        errors = [1e3 * row["position_m"] for row in right]
        turns = [math.degrees(row["rotation_rad"]) for row in right]
        shown = [
            f"{statistics.median(values):.{digits}f} ({max(values):.{digits}f})" if values else ""
            for values, digits in ((errors, 1), (turns, 2))
        ]
        lines.append([label, len(own), *share(len(right), len(own)), wrong, *shown])
    header = ["camera", "boards", "located", "Wilson 95 %", "located wrongly"]
    return [*header, "error, median (largest) [mm]", "rotation, median (largest) [deg]"], lines


def catch_table(rows):
    """Returns (header, rows): catches, and boards that were not located, by cell."""
    lines = []
    for cell in CATCH:
        own = [row for row in rows if row["kind"] == "catch" and row["cell"] == cell]
        if own:
            caught = sum(bool(row["success"]) for row in own)
            broke_off = sum("simulated_s" not in row for row in own)
            lines.append([cell, len(own), *share(caught, len(own)), broke_off])
    return ["ranges widened", "runs", "caught", "Wilson 95 %", "board not located"], lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", default=",".join(LOCATE), help="names separated by commas (default: all)")
    parser.add_argument("--locate", type=int, default=LOCATE_SEEDS, help=f"boards per cell (default {LOCATE_SEEDS})")
    parser.add_argument("--catch", type=int, default=CATCH_SEEDS, help=f"runs per cell (default {CATCH_SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    cells = options.cells.split(",")
    unknown = [cell for cell in cells if cell not in LOCATE]
    if unknown:
        parser.error(f"unknown cell {unknown[0]}; there are {', '.join(LOCATE)}")
    done = {(row["kind"], row["cell"], row["seed"]) for row in read_lines(options.results)}
    jobs = [
        (kind, cell, options.first_seed + k, overrides[cell])
        for kind, overrides, count in (("locate", LOCATE, options.locate), ("catch", CATCH, options.catch))
        for k in range(count)
        for cell in cells
        if (kind, cell, options.first_seed + k) not in done
    ]
    append_results(run_one, jobs, options.results, options.workers, describe)
    rows = [row for row in read_lines(options.results) if row["cell"] in cells]
    print_table(*locate_table(rows))
    print_table(*catch_table(rows))
    for row in rows:
        failed = not row["success"] if row["kind"] == "catch" else not row["located"] or is_wrong(row)
        if failed:
            print(f"failed: {describe(row)}")


if __name__ == "__main__":
    main()
