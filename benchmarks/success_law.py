"""Measures descents over speeds, lags, noises, paths, arms and estimators, for a law that says what decides success.

    python benchmarks/success_law.py                 the runs to which the law is fitted, and the cells that check it
    python benchmarks/success_law.py --part cells    the runs of one part; resumes
    python benchmarks/success_law.py --fit           only the fit, to the existing runs
    python benchmarks/success_law.py --draw          only the table and the chart, from the existing runs

The hand descends at a drawn time, whether or not the probability of success is high. Measured vision, whose errors are
scaled. Of each run the first descent counts: it is a success if the jaws hold the object and have lifted it. An arm
that has not begun a descent within `PATIENCE` has failed.

- ``fit``: a seed draws everything, or everything but what the names in `FITTED` say.
- ``cells``: each cell has an arm, a family of paths or an estimator that ``fit`` does not have; the seed draws the
  rest.

Three arms need packages: ``pip install --no-deps example-robot-data==6.0.0 pybullet==3.2.7``.

Each run becomes a line of ``results/success_law.jsonl`` as soon as it ends.
"""

import argparse
import math
import os
import tempfile
import time
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import yaml
from methods.first_descent import first_descent
from methods.law_fit import MEMORIES, SHARES, print_fit
from result_tables.law_tables import draw, law_table
from shared import common
from shared.common import append_results, print_table
from shared.public_arms import iiwa, panda, ur10
from shared.stored import read_lines

from drake_tracker import load_scenario
from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.grasp.success_law import AGE, STEP, demand, joint_shares, law_horizon, stray_ratios
from drake_tracker.measured.measured_error_file import load_error, save_error
from drake_tracker.tasks import train
from drake_tracker.tasks.train.setup import resolve

RESULTS = common.RESULTS / "success_law.jsonl"
PICTURE = Path(__file__).parent.parent / "docs" / "images" / "success_law.png"
PACKAGED = Path(train.__file__).with_name("train_vision.yaml")
"""The measured error of the packaged cameras."""
PATIENCE = 12.0
"""Simulated time [s] after which a run without a launch ends."""
ARMS = {
    "PUMA 560": "!Puma560 {}",
    "UR5e": "!UR5e {}",
    "seven joints": "!Custom {call: shared.public_arms.seven_with_jaws}",
    "Panda": "!Custom {call: shared.public_arms.panda}",
    "iiwa": "!Custom {call: shared.public_arms.iiwa}",
    "UR10": "!Custom {call: shared.public_arms.ur10}",
}
PUBLIC_ARMS = {"Panda": panda, "iiwa": iiwa, "UR10": ur10}
ESTIMATORS = {
    "arc length": "!ArcLength {}",
    "coordinated turn": "!CoordinatedTurn {}",
    "closed path": "!ClosedPath {}",
    "alpha-beta-gamma": "!AlphaBetaGamma {}",
}
PATHS = ("oval", "stadium", "figure_eight", "random_walk")
"""Families of paths that a seed draws."""


def drawn(seed):
    """Returns the condition that a seed draws: speed [m/s], lag [cycles of 1/60 s], factor of vision's errors, jaws
    [m], and so on."""
    rng = np.random.default_rng([seed, 84])
    path = str(rng.choice(PATHS))
    size = {
        "track.semi_axes": np.round(rng.uniform([0.05, 0.10], [0.16, 0.22]), 3).tolist(),
        "track.radius": round(rng.uniform(0.05, 0.16), 3),
        "track.straight": round(rng.uniform(0.05, 0.20), 3),
        "track.corner_radius": round(log_uniform(rng, 0.01, 0.08), 4),
    }
    if path == "random_walk":
        size["track.straight_range"] = [0.04, round(rng.uniform(0.06, 0.25), 3)]
    return {
        "path": path,
        "size": size,
        "arm": str(rng.choice(["PUMA 560", "UR5e", "seven joints"])),
        "estimator": str(rng.choice(["arc length", "coordinated turn", "closed path"])),
        "descent": str(rng.choice(["guided", "guided", "blind"])),
        "body": str(rng.choice(["train", "train", "cube"])),
        "speed": round(log_uniform(rng, 0.05, 0.5), 4),
        "lag": int(rng.integers(2, 31)),
        "noise": round(log_uniform(rng, 0.5, 6.0), 3),
        "jaws": round(rng.uniform(0.050, 0.088), 4),
    }


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


FITTED = {
    "": {},
    "Panda, ovals": {"arm": "Panda", "path": "oval", "speed": 0.2},
    "Panda, stadiums, blind": {"arm": "Panda", "path": "stadium", "descent": "blind", "speed": 0.12},
    "Panda, figures of eight": {"arm": "Panda", "path": "figure_eight", "speed": 0.1, "lag": 15},
    "Panda, lobes": {"arm": "Panda", "path": "lobes", "speed": 0.08},
    "lobes": {"path": "lobes", "speed": 0.1, "lag": 10},
    "lobes, blind": {"path": "lobes", "descent": "blind", "speed": 0.07},
    "lobes, noisy": {"path": "lobes", "noise": 5.0, "speed": 0.08},
    "circles, narrow jaws": {"path": "circle", "jaws": 0.055, "speed": 0.2},
    "iiwa, ovals": {"arm": "iiwa", "path": "oval", "speed": 0.15},
    "iiwa, stadiums, blind": {"arm": "iiwa", "path": "stadium", "descent": "blind", "speed": 0.12},
    "iiwa, figures of eight": {"arm": "iiwa", "path": "figure_eight", "speed": 0.08, "lag": 10},
    "iiwa, circles, fast": {"arm": "iiwa", "path": "circle", "speed": 0.25},
    "Lissajous": {"path": "lissajous", "speed": 0.1, "lag": 10},
    "Lissajous, blind": {"path": "lissajous", "descent": "blind", "speed": 0.07},
    "Lissajous, noisy": {"path": "lissajous", "noise": 4.0, "speed": 0.08},
    "iiwa, Lissajous": {"arm": "iiwa", "path": "lissajous", "speed": 0.07},
}
"""{group of the fit: what all its runs have in common}; the seed draws the rest."""
GAMMA = "alpha-beta-gamma"
CELLS = {
    "UR10": {"arm": "UR10", "speed": 0.15},
    "UR10, blind": {"arm": "UR10", "descent": "blind", "speed": 0.1},
    "UR10, figures of eight": {"arm": "UR10", "path": "figure_eight", "speed": 0.1, "lag": 15},
    "UR10, ovals, fast": {"arm": "UR10", "path": "oval", "speed": 0.25},
    "superellipses": {"path": "superellipse", "speed": 0.12, "lag": 10},
    "superellipses, blind": {"path": "superellipse", "descent": "blind", "speed": 0.08},
    "superellipses, noisy": {"path": "superellipse", "noise": 4.0, "speed": 0.1},
    "superellipses, late": {"path": "superellipse", "lag": 25, "speed": 0.08},
    "UR10, superellipses": {"arm": "UR10", "path": "superellipse", "speed": 0.1},
    "alpha-beta-gamma": {"estimator": GAMMA, "speed": 0.12, "lag": 8},
    "alpha-beta-gamma, blind": {"estimator": GAMMA, "descent": "blind", "speed": 0.08},
    "UR10, superellipses, alpha-beta-gamma": {
        "arm": "UR10",
        "path": "superellipse",
        "estimator": GAMMA,
        "speed": 0.08,
    },
}
"""{cell: what all its runs have in common}; the seed draws the rest."""
PARTS = {"fit": FITTED, "cells": CELLS}
FIRST_SEED = {name: 88000 if name.startswith(("iiwa", "Lissajous")) else 87000 for name in FITTED}
FIRST_SEED |= {"": 84000, **dict.fromkeys(CELLS, 89000)}
"""{group or cell: its first seed}; the groups from 87000 and from 88000 on were the cells of earlier laws."""
RUNS = {name: 206 if first == 88000 else 300 for name, first in FIRST_SEED.items()} | {"": 1300}
"""{group or cell: its runs}; those from 88000 on ended early, as the law that they checked had already failed."""


def condition_of(part, cell, seed):
    """Returns the condition of a run."""
    return {**drawn(seed), **PARTS[part][cell]}


def scenario_of(condition, seed, folder):
    """Returns the scenario of a run. Its noise is written into a folder."""
    rng = np.random.default_rng([seed, 85])
    closed = condition["path"] != "random_walk"
    settings = {
        **condition["size"],
        "track.kind": condition["path"],
        "track.speed": condition["speed"],
        "arm": ARMS[condition["arm"]],
        "estimator": ESTIMATORS[condition["estimator"]],
        "vision": f"!Measured {{method: !SeveralObjects {{}}, outline: box, lag_cycles: {condition['lag']}, "
        f"file: {noise_file(condition['noise'], folder)}}}",
        "grasp.descent": condition["descent"],
        "grasp.launch_probability": 0.0,
        "grasp.settle_time": round(rng.uniform(0.5, 6.0 if closed else 2.0), 2),
        "grasp.jaw_opening": condition["jaws"],
        "duration": PATIENCE + 8.0,
    }
    if condition["path"] == "random_walk":
        settings["track.length"] = 2.0
    elif condition["path"] in CURVES:
        settings |= {"track.kind": "csv", "track.csv": curve_file(CURVES[condition["path"]], rng, folder)}
    if condition["body"] == "cube":
        settings |= {"train.body": "cube", "track.turns": "false"}
    return load_scenario("train:guided", seed=seed, overrides=[f"{key}={value}" for key, value in settings.items()])


def lobes(rng, angle):
    """Returns the points of a closed curve with lobes, of random size, over an angle, shape (n, 2) [m]."""
    count, depth, radius = rng.integers(3, 7), rng.uniform(0.04, 0.15), rng.uniform(0.11, 0.14)
    distance = radius * (1.0 + depth * np.cos(count * (angle - rng.uniform(0.0, 2.0 * np.pi))))
    middle = rng.uniform(-0.02, 0.02, 2)
    return middle + distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def lissajous(rng, angle):
    """Returns the points of a Lissajous curve of three and two periods and of random size, as `lobes`."""
    sizes, phase = rng.uniform([0.09, 0.12], [0.14, 0.19]), rng.uniform(-0.12, 0.12)
    return rng.uniform(-0.02, 0.02, 2) + sizes * np.column_stack([np.sin(3.0 * angle + phase), np.sin(2.0 * angle)])


def superellipse(rng, angle):
    """Returns the points of a superellipse of random size and exponent, as `lobes`."""
    sizes, exponent = rng.uniform([0.07, 0.12], [0.14, 0.20]), rng.uniform(2.5, 4.0)
    ways = np.column_stack([np.cos(angle), np.sin(angle)])
    distance = np.sum(np.abs(ways / sizes) ** exponent, axis=1) ** (-1.0 / exponent)
    return rng.uniform(-0.02, 0.02, 2) + distance[:, None] * ways


CURVES = {"lobes": lobes, "lissajous": lissajous, "superellipse": superellipse}
"""{family of closed curves: its points over an angle}; their curvature changes all the time."""


def curve_file(curve, rng, folder):
    """Writes a random closed curve around the middle of the table to a file; returns its path."""
    path = Path(folder) / "curve.csv"
    points = [0.56, 0.0] + curve(rng, np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False))
    np.savetxt(path, points, delimiter=",", header="x,y", comments="", fmt="%.6f")
    return path


def noise_file(scale, folder):
    """Writes the error of the packaged cameras, with its random part scaled, to a file; returns its path."""
    path = Path(folder) / f"noise_{scale:g}.yaml"
    error = packaged_error()
    random = {"pattern": scale * error.pattern, "jitter": scale * error.jitter}
    save_error(path, replace(error, **random), rig=yaml.safe_load(PACKAGED.read_text())["rig"], notes={"scale": scale})
    return path


@lru_cache(maxsize=1)
def packaged_error():
    return load_error(PACKAGED)


def features(scenario, condition):
    """Returns what the law rests on, in SI units: {name: value}.

    ``strays`` has, for each of `MEMORIES`, the quantiles `SHARES` of how far the path strays within the horizon from an
    arc that continues it, as a share of what the jaws tolerate.
    """
    setup = resolve(scenario)
    track, _ = setup.placement
    grasp, speed = setup.grasp, scenario.track.speed
    horizon = law_horizon(grasp, condition["lag"] / 60.0)
    room = 0.5 * (grasp.jaw_opening - grasp.object_width)
    places = np.arange(0.5 * STEP, track.length * (2.0 if track.closed else 1.0), STEP)
    bend = track.curvature(places)
    rms = float(np.sqrt(np.mean(bend**2)))
    taken = joint_shares(setup.reach.model, setup.reach.q_initial)
    reach, parabola = None if grasp.turns else grasp.reach, condition["estimator"] == GAMMA
    ratios = lambda memory: stray_ratios(bend, speed * (horizon + AGE), memory, room, reach, parabola)  # noqa: E731
    covariance = packaged_error().covariance(0.0, speed)
    return {
        "horizon_s": round(horizon, 4),
        "room_m": round(room, 5),
        "reach_m": grasp.reach,
        "turns": grasp.turns,
        "length_m": round(track.length, 3),
        "closed": track.closed,
        "noise_m": round(condition["noise"] * math.sqrt(0.5 * (covariance[0, 0] + covariance[1, 1])), 6),
        "demand": round(demand(speed, rms, grasp.turns, taken), 4),
        "bend_max": round(float(np.max(np.abs(bend))), 2),
        "bend_rms": round(rms, 2),
        "strays": [np.round(np.quantile(ratios(memory), SHARES), 3).tolist() for memory in MEMORIES],
    }


def run_one(job):
    """Runs one descent in a worker; returns its line, or `Lost`."""
    part, cell, seed = job
    start = time.monotonic()
    condition = condition_of(part, cell, seed)
    try:
        if condition["arm"] in PUBLIC_ARMS:
            PUBLIC_ARMS[condition["arm"]]()  # raises OSError where its file is not installed: that is no refused layout
        with tempfile.TemporaryDirectory() as folder:
            scenario = scenario_of(condition, seed, folder)
            found = {**features(scenario, condition), **first_descent(scenario, PATIENCE)}
    except DrakeTrackerError as error:
        found = {"end": "refused", "lifted": False, "said": str(error).splitlines()[0]}
    except (MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    row = {"part": part, "cell": cell, "seed": seed, "scenario": "train:guided", **condition, **found}
    return {**row, "wall_s": round(time.monotonic() - start, 2)}


def describe(row):
    return f"{row['cell'] or row['part']}, seed {row['seed']}: {row['end']}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=PARTS, help="runs of one part (default: of both)")
    parser.add_argument("--runs", type=int, help="runs of each group or cell")
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    parser.add_argument("--fit", action="store_true", help="run nothing; fit the law")
    parser.add_argument("--draw", action="store_true", help="run nothing; print the table of the cells, draw the chart")
    options = parser.parse_args()
    if options.fit:
        return print_fit([row for row in read_lines(options.results) if row["part"] == "fit"])
    if options.draw:
        rows = read_lines(options.results)
        print_table(*law_table(rows))
        return draw(rows, PICTURE if options.results == RESULTS else options.results.with_suffix(".png"))
    jobs = []
    for part in [options.part] if options.part else PARTS:
        for cell in PARTS[part]:
            first = FIRST_SEED[cell] if options.first_seed is None else options.first_seed
            jobs += [(k, (part, cell, first + k)) for k in range(options.runs or RUNS[cell])]
    jobs = [job for _, job in sorted(jobs)]
    done = {(row["part"], row["cell"], row["seed"]) for row in read_lines(options.results)}
    append_results(run_one, [job for job in jobs if job not in done], options.results, options.workers, describe)


if __name__ == "__main__":
    main()
