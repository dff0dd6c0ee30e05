"""Chooses the parameters of those that have to be tuned, once, before any published run.

    python benchmarks/estimation/tune.py [--workers N]

Each has the same budget: `CANDIDATES` settings, tried on the same runs of the tuning seeds with white noise. Of them
that one is kept whose errors at the present and at the grasp horizon have the least product. Alpha-beta-gamma and arc
length are tuned on the stadium at constant speed, once for each noise; the baselines on the oval at 1 mm, once for each
speed law, and the turn's also on each path with sharp bends, from candidates of its own. Stone Soup's and filterpy's
filters of one model are the same filter, as they should be (they differ by 1e-5 of the error), so that the faster is
tuned for both. Coordinated turn and closed path are not tuned: their defaults are their one setting, for every path,
noise and law.
"""

import argparse
import itertools
import json
import multiprocessing
import os
import sys

import numpy as np
from contestants import PARAMETERS, contestant
from measure import EVERY, HORIZONS, WARM_UP, follow
from worlds import SHARP, SPEED_LAWS, make_world

SEEDS = tuple(range(1000, 1006))
DURATION = 20.0
SIGMAS_MM = (0.5, 1.0, 2.0, 4.0)
CANDIDATES = 12


def candidates():
    """Returns for each name its `CANDIDATES` settings; "sharp turn" is the turn's filter on the paths of `SHARP`."""
    factors, bendings = (0.4, 0.7, 1.2), (12, 18, 26, 40)
    grids = {
        "alpha_beta_gamma": [{"tracking_index": float(f"{x:.2g}")} for x in np.geomspace(1e-4, 2e-2, CANDIDATES)],
        "arc_length": [
            {"anchor_order": round(10 * f), "heading_order": round(20 * f), "bending_order": bending}
            for f, bending in itertools.product(factors, bendings)
        ],
        "velocity": [{"noise": float(f"{x:.2g}")} for x in np.geomspace(3e-4, 0.3, CANDIDATES)],
        "acceleration": [{"noise": float(f"{x:.2g}")} for x in np.geomspace(1e-3, 3.0, CANDIDATES)],
        "turn": [
            {"noise": noise, "turn_noise": turn}
            for noise, turn in itertools.product((1e-6, 1e-4, 1e-3, 1e-2), (0.12, 0.25, 0.5))
        ],
        "sharp turn": [
            {"noise": noise, "turn_noise": turn}
            for noise, turn in itertools.product((3e-3, 1e-2, 3e-2), (1e-3, 1e-2, 0.1, 0.5))
        ],
    }
    assert all(len(grid) == CANDIDATES for grid in grids.values())
    return grids


def try_out(job):
    """Returns the mean squares [m^2] at both horizons of one setting, over all tuning seeds."""
    name, path, sigma_mm, law, setting = job
    if name in ("alpha_beta_gamma", "arc_length"):
        contestant_name, parameters = name, {name: {f"{sigma_mm:g}": setting}}
    else:
        contestant_name, parameters = f"filterpy_{name}", {name: {f"{path} {law}": setting}}
    squares = []
    for seed in SEEDS:
        world = make_world(path, "white", 1e-3 * sigma_mm, law, seed, DURATION)
        judged = np.arange(round(60 * WARM_UP), len(world.times), EVERY)
        estimator = contestant(contestant_name, sigma_mm, law, parameters, path)
        rows, _ = follow(estimator, world.times, world.points, judged)
        truth = [world.pose(world.times[judged] + ahead)[:, :2] for ahead in HORIZONS.values()]
        squares.append([np.mean(np.sum((rows[:, k, :2] - at) ** 2, axis=1)) for k, at in enumerate(truth)])
    return np.mean(squares, axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # matrices are small: more threads only get in the way
    jobs = []
    for name, grid in candidates().items():
        ours = name in ("alpha_beta_gamma", "arc_length")
        model, paths = ("turn", SHARP) if name == "sharp turn" else (name, ("oval",))
        places = [(path, 1.0, law) for path in paths for law in SPEED_LAWS]
        if ours:
            places = [("stadium", sigma_mm, "constant") for sigma_mm in SIGMAS_MM]
        jobs += [(model, *place, setting) for place in places for setting in grid]
    with multiprocessing.get_context("spawn").Pool(options.workers) as pool:
        found = []
        for job, squares in zip(jobs, pool.imap(try_out, jobs)):
            found.append((job, squares))
            rms = np.round(1e3 * np.sqrt(squares), 2)
            print(f"[{len(found)}/{len(jobs)}] {job}: {rms} mm", file=sys.stderr, flush=True)
    chosen = {"tuned": {"seeds": [SEEDS[0], SEEDS[-1]], "duration_s": DURATION, "candidates": CANDIDATES, "rms_mm": {}}}
    for place in dict.fromkeys(job[:4] for job, _ in found):
        name, path, sigma_mm, law = place
        of_it = [(job[4], squares) for job, squares in found if job[:4] == place]
        setting, squares = min(of_it, key=lambda item: np.prod(item[1]))
        rms = [round(1e3 * float(np.sqrt(value)), 3) for value in squares]
        chosen["tuned"]["rms_mm"][f"{name} {path} {sigma_mm:g} mm {law}"] = rms
        key = {"stadium": f"{sigma_mm:g}", "oval": law}.get(path, f"{path} {law}")
        chosen.setdefault(name, {})[key] = setting
    PARAMETERS.write_text(json.dumps(chosen, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
