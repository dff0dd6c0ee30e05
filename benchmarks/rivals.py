"""Measures how often the object is lifted on motions of other people's benchmarks, beside their success rates.

    python benchmarks/rivals.py                                    all families, 100 runs a cell; resumes
    python benchmarks/rivals.py --family dgbench,dom --lags 6      some of them
    python benchmarks/rivals.py --rendered --lags 15 --seeds 1     with cameras

The motions are implemented from their descriptions (`methods/rival_motions.py`), without their code or data:

- ``dgbench``: random walks of 2 m as its generator makes them, within 140 mm of the middle, at 0.1 to 0.2 m/s;
- ``dgbench_140``: the same in a square of 140 mm, as in `hard_paths.py`;
- ``domino``: constant velocity, polynomial and chaotic motion, each run at a speed drawn from 0.1 to 0.5 m/s;
- ``dom``: the benchmark of DynamicVLA, one straight pass over the table at 0.15 to 0.75 m/s;
- ``columbia``: Akinola et al. 2021, straight and circular conveyors at 0.03 and 0.05 m/s. Their height varies, which is
  not covered here.

`train:guided` grasps a cube of 30 mm that does not turn and moves at a constant speed, with measured vision that is
late by the lag. The cube must be gripped before it reaches the end of its path; the 2.2 s after it are for lifting. A
path on which the arm has less time than a grasp takes is not run: it counts as a failure, out of reach. None is the
same task as the rival's; the table says in what it differs. A seed has the same path at all speeds and lags. The
published seeds are 76000 and above; seeds of development are 76900 and above. Each run becomes a line of
``results/rivals.jsonl`` as soon as it ends.
"""

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np
from hard_paths import KEPT, LIFT, MEASURED, summary_of
from methods.rival_motions import FAMILIES, length_of
from result_tables.rival_tables import describe, rivals_table
from shared import common
from shared.common import append_results, print_table
from shared.stored import read_lines

from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import DrakeTrackerError, MachineError

FIRST_SEED, FIRST_OF_DEVELOPMENT = 76000, 76900
RESULTS = common.RESULTS / "rivals.jsonl"
SCENARIO = "train:guided"
LAGS = (15, 6, 3)
"""Lags of vision [cycles of 1/60 s]."""
KEYS = ("rival", "motion", "speeds", "lag", "seed", "rendered")


def all_jobs(families, lags, seeds, rendered):
    """Returns (rival, motion, text of the speeds, lag, seed, rendered) of every run, seed by seed."""
    return [
        (family, name, speeds, lag, seed, rendered)
        for seed in seeds
        for family in families
        for name, motion in FAMILIES[family].items()
        for lag in lags
        for speeds in motion.speeds
    ]


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    family, name, speeds, lag, seed, rendered = job
    motion = FAMILIES[family][name]
    points, speed = motion.draw(seed, speeds)
    latest = length_of(points) / speed
    row = {**dict(zip(KEYS, job, strict=True)), "scenario": SCENARIO, "speed": speed, "out_of_reach": False}
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "path.csv"
            np.savetxt(path, points, delimiter=",", header="x,y", comments="", fmt="%.5f")
            overrides = [] if rendered else [f"vision={MEASURED[SCENARIO]}"]
            overrides += [f"track.speed={speed}", "track.kind=csv", f"track.csv={path}", "track.closed=false"]
            overrides += ["track.direction=forward", "track.turns=false", "train.body=cube"]
            overrides += [f"vision.lag_cycles={lag}", f"duration={latest + LIFT}"]
            if motion.work_volume is not None:
                overrides += [f"vision.work_volume={[list(corner) for corner in motion.work_volume]}"]
            summary = summary_of(SCENARIO, seed, overrides, folder, latest)
    except (MachineError, MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    except DrakeTrackerError as error:
        if "within the arm's reach for" not in str(error):
            raise
        reason = str(error)[str(error).index("the train is") :].split(";")[0]
        return {**row, **dict.fromkeys(KEPT), "success": False, "out_of_reach": True, "failure_reason": reason}
    return {**row, **{key: summary.get(key) for key in KEPT}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--family", default=",".join(FAMILIES), help=f"of {', '.join(FAMILIES)} (default: all)")
    parser.add_argument(
        "--lags", default=",".join(map(str, LAGS)), help="cycles, separated by commas (default: 15,6,3)"
    )
    parser.add_argument("--seeds", type=int, default=100, help="runs of each cell (default 100)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help=f"default {FIRST_SEED}")
    parser.add_argument("--rendered", action="store_true", help="with cameras")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    families, lags = options.family.split(","), [int(lag) for lag in options.lags.split(",")]
    if not set(families) <= set(FAMILIES):
        parser.error(f"--family {options.family}: there are {', '.join(FAMILIES)}")
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    done = {tuple(row[key] for key in KEYS) for row in read_lines(options.results)}
    jobs = [job for job in all_jobs(families, lags, seeds, options.rendered) if job not in done]
    append_results(run_one, jobs, options.results, options.workers, describe)
    print_table(*rivals_table(read_lines(options.results)))


if __name__ == "__main__":
    main()
