"""Measures how often each policy succeeds over the total latency, from 0 to 0.5 s.

    python benchmarks/latency_curve.py                 two objects on the oval, 20 episodes a cell; resumes
    python benchmarks/latency_curve.py --task ball     the ball, with cameras
    python benchmarks/latency_curve.py --draw          only the table and the picture, from the existing results

The five policies of `make_policy` move the hand in an environment. The total latency is the lag of the cameras: actions
take effect at once. On the oval, all policies get the same points of measured vision, and an episode is a success if
the object is lifted within 30 s, at any attempt. The policy ``truth`` has the true position without lag; it is run at
the smallest lag only. The ball has no measured vision and no policy ``guided``, and its lag is 3 to 26 cycles: vision
needs three, and the hand trusts no prediction older than 0.45 s. The published seeds are 75000 and above; nothing was
chosen on them. Each episode becomes a line of ``results/latency_curve.jsonl`` as soon as it ends.
"""

import argparse
import time
from functools import lru_cache
from pathlib import Path

from result_tables.latency_curve_tables import POLICIES, describe, draw, latency_table
from shared import common
from shared.common import append_results, print_table
from shared.stored import read_lines

from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.environments import TrackerEnvironment, make_policy, run_episode
from drake_tracker.tasks import load_scenario, task_of

FIRST_SEED, SEEDS = 75000, 20
LAGS = (0, 3, 6, 10, 15, 20, 25, 30)
"""Of vision [cycles of 1/60 s]."""
POSSIBLE = {"train": (0, 30), "ball": (3, 26)}
"""{task: smallest and largest lag that are run [cycles]}."""
MEASURED = ["vision=!Measured {method: !SeveralObjects {}, outline: box}", "duration=30"]
CELLS = {
    "cube, 0.20 m/s": ("train", "train:guided", [*MEASURED, "train.body=cube", "track.speed=0.20"]),
    "train, 0.15 m/s": ("train", "train:guided", [*MEASURED, "track.speed=0.15"]),
    "ball": ("ball", "ball", []),
}
"""{cell: task, scenario, overrides}."""
RESULTS = common.RESULTS / "latency_curve.jsonl"
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "latency_curve.png"


def all_jobs(task, lags, seeds, first_seed):
    """Returns (cell, policy, lag, seed) of every episode, seed by seed."""
    smallest, largest = POSSIBLE[task]
    lags = sorted({min(max(lag, smallest), largest) for lag in lags})
    return [
        (cell, policy, lag, seed)
        for seed in range(first_seed, first_seed + seeds)
        for cell, (of, _, _) in CELLS.items()
        if of == task
        for policy in POLICIES
        if task == "train" or policy != "guided"
        for lag in (lags[:1] if policy == "truth" else lags)
    ]


@lru_cache(maxsize=1)
def initialised(name, seed):
    """Returns the initialisation of a scenario, once for all episodes of a seed."""
    scenario = load_scenario(name, seed=seed)
    return task_of(scenario).initialise(scenario)


def run_one(job):
    """Runs an episode in a worker; returns its line, or `Lost`."""
    cell, policy, lag, seed = job
    task, name, overrides = CELLS[cell]
    start = time.monotonic()
    try:
        env = TrackerEnvironment(
            name,
            overrides,
            camera_lag=lag / 60,
            observe=("joints", "truth" if policy == "truth" else "points"),
            initialisation=initialised(name, seed) if task == "ball" else None,
        )
        try:
            outcome = run_episode(env, make_policy(policy, env), seed)
        finally:
            env.close()
    except (DrakeTrackerError, MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    kept = {key: outcome[key] for key in ("success", "reason")}
    kept |= {"simulated_s": round(outcome["time"], 3), "wall_s": round(time.monotonic() - start, 3)}
    return {"cell": cell, "scenario": name, "policy": policy, "lag_cycles": lag, "seed": seed, **kept}


def key_of(row):
    """Returns the job of a line."""
    return tuple(row[key] for key in ("cell", "policy", "lag_cycles", "seed"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", choices=tuple(POSSIBLE), default="train")
    parser.add_argument("--lags", default=",".join(map(str, LAGS)), help="cycles of 1/60 s, separated by commas")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"episodes per cell (default {SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--draw", action="store_true", help="run nothing; print the table and draw the picture")
    parser.add_argument("--workers", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    if not options.draw:
        lags = [int(lag) for lag in options.lags.split(",")]
        done = {key_of(row) for row in read_lines(options.results)}
        jobs = all_jobs(options.task, lags, options.seeds, options.first_seed)
        jobs = [job for job in jobs if job not in done]
        append_results(run_one, jobs, options.results, options.workers, describe)
    rows = read_lines(options.results)
    if rows:
        print_table(*latency_table(rows))
        draw(rows, PICTURE if options.results == RESULTS else options.results.with_suffix(".png"))


if __name__ == "__main__":
    main()
