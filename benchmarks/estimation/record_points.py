"""Records the errors of triangulated points in the camera loop, which the benchmark replays as noise.

    python benchmarks/estimation/record_points.py [--laps N] [--out FILE]

`train:learned` runs without a grasp, in both directions and at two speeds, on seeds below 100. Kept are a point's
stamp [s], the train's true yaw [rad] then, and the error of the point in W [m], in `FIELDS`, one row for each point.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tracking import run

from drake_tracker import load_scenario
from drake_tracker.tasks.train.episode import train_pose
from drake_tracker.tasks.train.setup import resolve

OUT = Path(__file__).with_name("camera_points.npz")
FIELDS = ("stamp", "yaw", "x", "y", "z")
RUNS = ((10, "forward", 0.15), (11, "backward", 0.15), (12, "forward", 0.10), (13, "backward", 0.20))
"""Seed, direction and speed [m/s] of each run."""
SETTLED = 2.0
"""Before this time [s] the train gathers speed and the detector finds it."""


def record(seed, direction, speed, laps):
    """Returns rows (n, 5) of `FIELDS` from ``laps`` laps of the camera loop."""
    overrides = [f"track.speed={speed}", f"track.direction={direction}"]
    scenario = load_scenario("train:learned", seed=seed, overrides=overrides)
    duration = laps * resolve(scenario).track.length / speed + SETTLED
    scenario = scenario.with_settings({"duration": duration, "grasp.settle_time": 2 * duration})  # no grasp
    log, _, _, _ = run(scenario)
    point = log["point"]
    good = (point["stamp"] > SETTLED) & (point["valid"] > 0)
    stamps, first = np.unique(point["stamp"][good], return_index=True)  # the log holds a point until the next one
    truth = train_pose(log, stamps)
    found = point.view("x", "y", "z")[good][first]
    rows = np.column_stack([stamps, truth[:, 3], found - truth[:, :3]])
    return rows[np.isfinite(rows).all(axis=1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laps", type=float, default=1.5, help="laps of each of the four runs")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    recorded = {}
    for number, (seed, direction, speed) in enumerate(RUNS):
        rows = record(seed, direction, speed, options.laps)
        recorded[f"run_{number}"] = rows.astype(np.float32)
        rms = 1e3 * np.sqrt(np.mean(rows[:, 2:] ** 2, axis=0))
        print(f"seed {seed} {direction} {speed} m/s: {len(rows)} points, rms x, y, z {np.round(rms, 2)} mm", flush=True)
        np.savez_compressed(options.out, **recorded)


if __name__ == "__main__":
    main()
