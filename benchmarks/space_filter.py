"""Measures the arc-length filter in space: what its inversion of moments recovers, and how well it predicts.

    python benchmarks/space_filter.py [--seeds N] [--json FILE]

Moments: s_0 and sigma from two million measured arc lengths in space, by the inversion of space and by the planar
inversion of the paper on the same data. Predictions: white noise of 1 mm per axis at 60 Hz, and the rms error per axis
0.25 and 0.75 s ahead, beside the planar filter on a level circle of the same curvature (two axes) and on the same
path. Estimators: the error across the level and of the height on the hill, 0.25 and 0.75 s ahead, from the second lap
on. The published seeds are 80000 and above; constants were chosen with seeds below 100.
"""

import argparse

import numpy as np
from result_tables.space_filter_tables import TABLES
from shared.common import print_table, save_json

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.parts.rice import recover_arc_length

FIRST_SEED, SEEDS = 80000, 20
RATIOS = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
"""s_0 / sigma."""
SAMPLES = 2_000_000
SIGMA, DURATION, SETTLED = 0.001, 8.0, 2.5
"""Noise per axis [m], duration of a run, and time from which on predictions count [s]."""
AHEAD = (0.25, 0.75)
SPEEDS = (0.1, 0.15, 0.2)
ESTIMATORS = {
    "AlphaBetaGamma": ("alpha_beta_gamma", {}),
    "CoordinatedTurn": ("coordinated_turn", {}),
    "ClosedPath": ("closed_path", {}),
    "ArcLength": ("arc_length", {}),
    "ArcLength, mode: space": ("arc_length", {"mode": "space"}),
}
"""{name: kind and settings}."""
LAPS = 9.0
"""Time in which the hill is passed more than once at `SPEEDS`[1] [s]."""
PITCH = 0.26
"""Pitch angle of the helices [rad], about 15 deg."""


class Path:
    """Points of a closed or climbing path by its length, at a constant speed."""

    def __init__(self, radius, heights=0.0, pitch=0.0):
        angle = np.linspace(0.0, 6.0 * np.pi, 60001)
        z = 0.5 + heights * np.sin(angle) + radius * angle * np.tan(pitch)
        self.points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        self.length = np.concatenate([[0.0], np.cumsum(steps)])

    def at(self, distance):
        return np.column_stack([np.interp(distance, self.length, column) for column in self.points.T])


def paths(radius):
    """Returns {name: path} with the curvature of a circle; a hill rises by 14 deg once per lap."""
    return {
        f"helix, {np.degrees(PITCH):.0f} deg": Path(radius * np.cos(PITCH) ** 2, pitch=PITCH),
        "hill of +-40 mm": Path(0.16, heights=0.04),
    }


def errors(kind, settings, path, speed, seeds, settled=SETTLED):
    """Returns the mean square error of each axis at each time ahead, shape (2, 3) [m^2]."""
    times, squares = VISION_PERIOD * np.arange(round((settled - SETTLED + DURATION) / VISION_PERIOD)), []
    for seed in seeds:
        estimator = make_estimator(kind, **settings)
        state, noise = estimator.initial_state(), np.random.default_rng(seed).normal(size=(len(times), 3))
        for k, (time, point) in enumerate(zip(times, path.at(speed * times) + SIGMA * noise, strict=True)):
            state = estimator.update(state, time, point)
            if time >= settled and k % 3 == 0:
                later = time + np.array(AHEAD)
                squares.append((estimator.predict(state, later)[:, :3] - path.at(speed * later)) ** 2)
    return np.mean(squares, axis=0)


def per_axis(squares, axes):
    """Returns the rms error per axis at each time ahead [m], of the first ``axes`` axes."""
    return np.sqrt(squares[:, :axes].mean(axis=1)).tolist()


def moments(seed):
    """Returns what both inversions recover from arc lengths measured in space."""
    rng, rows = np.random.default_rng(seed), []
    for ratio in RATIOS:
        s = np.linalg.norm(rng.normal(size=(SAMPLES, 3)) + [ratio, 0.0, 0.0], axis=1)
        found = {n: recover_arc_length(float(s.mean()), float(np.mean(s**2)), dimensions=n) for n in (2, 3)}
        rows.append(
            {
                "ratio": ratio,
                **{f"s_0_{n}": found[n].s_0 / ratio for n in found},
                **{f"sigma_{n}": found[n].sigma for n in found},
            }
        )
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"runs of each path (default {SEEDS})")
    parser.add_argument("--json")
    options = parser.parse_args()
    seeds = range(FIRST_SEED, FIRST_SEED + options.seeds)
    rows = []
    for radius in (0.12, 0.20):
        for speed in SPEEDS:
            level = per_axis(errors("arc_length", {}, Path(radius), speed, seeds), 2)
            for name, path in paths(radius).items():
                if name.startswith("hill") and radius != 0.12:
                    continue
                space, plane = (
                    per_axis(errors("arc_length", {"mode": mode}, path, speed, seeds), 3)
                    for mode in ("space", "baseline")
                )
                rows.append(
                    {
                        "path": name,
                        "radius": 0.16 if name.startswith("hill") else radius,
                        "speed": speed,
                        "space": space,
                        "plane": plane,
                        "level": level,
                    }
                )
                print(rows[-1], flush=True)
    hill, estimators = Path(0.16, heights=0.04), []
    for name, (kind, settings) in ESTIMATORS.items():
        squares = errors(kind, settings, hill, SPEEDS[1], seeds, LAPS)
        level, height = np.sqrt(squares[:, :2].sum(axis=1)).tolist(), np.sqrt(squares[:, 2]).tolist()
        estimators.append({"estimator": name, "level": level, "height": height})
    found = {"estimators": estimators, "moments": moments(FIRST_SEED), "rows": rows}
    for table in TABLES.values():
        print_table(*table(found))
    save_json(found, options.json, seeds)


if __name__ == "__main__":
    main()
