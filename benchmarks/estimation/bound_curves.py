"""Bounds over the horizon, for the figure of error against horizon: makes ``drake_tracker/figures/bounds.json``.

    python benchmarks/estimation/bound_curves.py [-o FILE] [--runs N]

The world is the figure's own: its stadium, speed, noise and laps; the mean is over the directions and starts of so many
of its runs, and over predictions made as often as the figure judges them.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from bounds import closed_path_bound, constant_curvature_floor, curvature_changes, first_lap_bound

import drake_tracker.figures
from drake_tracker.figures.horizon import CLOSED_FROM, EVERY, HORIZONS, LAPS, SIGMA, SPEED, make_drive

OUT = Path(drake_tracker.figures.__file__).with_name("bounds.json")
SEED = 0
"""Of the figure."""
RUNS = 8
FIRST = 1.0
"""Judged is from this time [s] on: every estimator is ready by then."""
SPARSER = 4
"""One of so many predictions judged is enough for a mean."""


def tangents(drive, times):
    yaw = drive.pose(times)[2]
    return np.column_stack([np.cos(yaw), np.sin(yaw)])


def first_lap(drive, ahead):
    """Returns mean squares [m^2] of predictions made in the first lap, but for what the unknown next bend adds."""
    track = drive.track
    changes = np.sort((curvature_changes(track) - drive.start) % track.length)
    edges = np.concatenate([[0.0], changes, [track.length]])
    curvatures = track.curvature(drive.start + 0.5 * (edges[1:] + edges[:-1]))
    known = float(np.sqrt(np.mean(track.curvature(np.linspace(0.0, track.length, 500)) ** 2)))
    times = drive.times[drive.times <= track.length / SPEED]
    present = times[EVERY * SPARSER :: EVERY * SPARSER]
    present = present[present >= FIRST]
    until = times[times <= present[-1]]
    start = float(drive.pose([0.0])[2][0])
    rows = first_lap_bound(until, start, SPEED, changes / SPEED, curvatures, SIGMA, known, present, ahead)
    return rows.mean(axis=0)


def after_closure(drive, ahead):
    """Returns mean squares [m^2] of predictions made from the lap on with whose end the path is known."""
    length = drive.track.length
    tangent = tangents(drive, drive.times)
    first = int(np.searchsorted(drive.times, CLOSED_FROM * length / SPEED))
    squares = []
    for index in range(first, len(drive.times), EVERY * SPARSER):
        query = drive.times[index] + ahead
        seen = slice(index + 1)
        squares.append(
            closed_path_bound(drive.times[seen], tangent[seen], query, tangents(drive, query), length, SPEED, SIGMA)
        )
    return np.mean(squares, axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=OUT)
    parser.add_argument("--runs", type=int, default=RUNS)
    options = parser.parse_args()
    ahead = HORIZONS[1:]  # of the present itself the floor is 0, and the axis is logarithmic
    drives = [make_drive([SEED, 3, run], laps=LAPS) for run in range(options.runs)]
    floor = constant_curvature_floor(drives[0].track, SPEED, ahead)
    curves = {
        ("constant curvature, no noise", "both"): floor,
        ("bound of the first lap", "first_lap"): floor + np.mean([first_lap(drive, ahead) for drive in drives], axis=0),
        ("bound of a closed path", "after_closure"): np.mean([after_closure(drive, ahead) for drive in drives], axis=0),
    }
    found = [
        {
            "name": name,
            "stage": stage,
            "horizon_s": [round(float(tau), 4) for tau in ahead],
            "rms_m": [float(f"{value:.4g}") for value in np.sqrt(squares)],
        }
        for (name, stage), squares in curves.items()
    ]
    options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    for curve in found:
        at = {tau: 1e3 * rms for tau, rms in zip(curve["horizon_s"], curve["rms_m"])}
        print(f"{curve['name']}: {at[0.25]:.2f} mm at 0.25 s, {at[0.75]:.2f} mm at 0.75 s")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
