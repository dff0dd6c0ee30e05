"""Measures how often a descent that begins at a drawn time lifts the object, beside the probability computed for it.

    python benchmarks/launches.py                              every group; resumes
    python benchmarks/launches.py --group guided --runs 300    some of them

The launch gate is replaced by a drawn time, so that launches of every probability occur, and no descent is aborted
because its probability is low. Measured vision, except in groups with cameras. Of each run the first descent counts: it
is a success if the jaws hold the object and have lifted it. A seed draws path, speed, lag of vision, opening of the
jaws and the time of the launch:

- ``learned``: the blind descent of `train:learned` on closed tracks;
- ``guided``: the guided descent of `train:guided`, on closed tracks and random walks, of a train or of a cube that does
  not turn;
- ``from 0.80`` and others: the same runs as ``guided``, with the launch gate and this `grasp.launch_probability`;
- ``guided with cameras``, ``wrist with cameras``, ``hill with cameras``: `train:guided`, `train:wrist` and
  `train:hill_guided` with cameras, on closed tracks (on hills: ovals), of a train;
- ``conveyor``: `conveyor:measured` for 40 s; the seed draws speed and motion of the belt and a factor of vision's
  errors, which the estimator's `systematic_std` knows, and all descents count. The jaws open little wider than the
  discs. There are no ells: jaws that narrow would come down 1 mm beside an ell's short leg.

Seeds from 95000 on are for results, those of ``guided`` and of the thresholds from 103000 on, those of hills from
107000 on; 82000 to 85999 and 101000 to 102299 for the choice of constants. Each run becomes a line of
``results/launches.jsonl`` as soon as it ends.
"""

import argparse
import math
import os
import tempfile
import time
from pathlib import Path

import numpy as np
from methods.first_descent import first_descent
from shared import common
from shared.common import append_results
from shared.stored import read_lines

from drake_tracker import load_scenario, simulate
from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.estimation.config import Belt
from drake_tracker.grasp.config import GraspConfig, PickConfig
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.measured.config import MeasuredParts
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world.conveyor.conveyor_config import ArrivalsConfig

THRESHOLDS = {"from 0.80": 0.8, "from 0.90": 0.9, "from 0.95": 0.95, "from 0.99": 0.99}
"""{group: its `grasp.launch_probability`}."""
RENDERED = {
    "guided with cameras": "train:guided",
    "wrist with cameras": "train:wrist",
    "hill with cameras": "train:hill_guided",
}
"""{group with cameras: its scenario}."""
RUNS = {"learned": 3000, "guided": 3000, "conveyor": 240}
RUNS |= {**dict.fromkeys(THRESHOLDS, 120), **dict.fromkeys(RENDERED, 300)}
"""{group: its runs}; a run of the conveyor has about thirteen descents."""
FIRST_SEEDS = {**dict.fromkeys(RUNS, 95000), **dict.fromkeys(("guided", *THRESHOLDS), 103000)}
FIRST_SEEDS |= {"hill with cameras": 107000}
"""{group: its first seed}."""
RESULTS = common.RESULTS / "launches.jsonl"
GROUPS = {
    "learned": "train:learned",
    "guided": "train:guided",
    "conveyor": "conveyor:measured",
    **dict.fromkeys(THRESHOLDS, "train:guided"),
    **RENDERED,
}
"""{group: its scenario}."""
LAGS = (3, 6, 10, 15, 20, 25)
"""Of vision [cycles of 1/60 s]."""
CLOSED = ("oval", "stadium", "circle")
LATEST = {False: 12.0, True: 3.0}
"""{whether the track ends: longest time above the object before the launch [s]}; closed paths are learned in a lap."""
BELT_ERRORS = {
    name: getattr(MeasuredParts, name) for name in ("noise_std", "bias_std", "turn_noise_std_deg", "turn_bias_std_deg")
}
"""{what errors the vision of parts has: its usual size}."""
LARGEST_ERROR = 20.0
"""Largest factor of these errors."""
BOXES_AND_DISCS = (1.0, 1.0, 0.0)
BELT_TIME = 40.0
"""Duration of a run of the conveyor [s]."""
ABORT = {config: config.abort_probability for config in (GraspConfig, PickConfig)}
"""{settings of a hand: probability of success below which it aborts its descent}."""
LONGEST = 60.0
"""Simulated time [s] after which a run without a launch ends."""


def draw(group, seed):
    """Returns the settings of a run, {key: value}."""
    rng = np.random.default_rng([seed, 83])
    closed = group == "learned" or group in RENDERED
    shape = "oval" if group == "hill with cameras" else str(rng.choice(CLOSED if closed else (*CLOSED, "random_walk")))
    speed = round(math.exp(rng.uniform(math.log(0.05), math.log(0.35))), 4)
    found = {
        "track.kind": shape,
        "track.speed": speed,
        "track.semi_axes": np.round(rng.uniform([0.06, 0.12], [0.16, 0.22]), 3).tolist(),
        "track.radius": round(rng.uniform(0.06, 0.16), 3),
        "track.straight": round(rng.uniform(0.05, 0.20), 3),
        "track.corner_radius": round(math.exp(rng.uniform(math.log(0.01), math.log(0.08))), 4),
        "grasp.gate": "probability",
        "grasp.launch_probability": 0.0,
        "grasp.settle_time": round(rng.uniform(0.0, LATEST[shape == "random_walk"]), 2),
        "grasp.jaw_opening": round(rng.uniform(0.056, 0.088), 4),
        "duration": LONGEST,
    }
    if shape == "random_walk":
        found |= {"track.length": 2.0, "track.straight_range": [0.04, 0.20]}
    if not closed and rng.uniform() < 0.4:
        found |= {"train.body": "cube", "track.turns": False}
    if group in THRESHOLDS:
        found["grasp.launch_probability"] = THRESHOLDS[group]
        del found["grasp.settle_time"]
    return found, int(rng.choice(LAGS))


def draw_belt(seed):
    """Returns the settings of a run of the conveyor, its lag of vision [cycles], and the factor of vision's errors."""
    rng = np.random.default_rng([seed, 83])
    found = {
        "belt.speed": round(math.exp(rng.uniform(math.log(0.06), math.log(0.35))), 4),
        "belt.motion": str(rng.choice(["running", "stop_and_go", "two_speed"])),
        "belt.acceleration": round(math.exp(rng.uniform(math.log(0.2), math.log(3.0))), 3),
        "arrivals.rate": 30.0,
        "pick.launch_probability": 0.0,
        "pick.jaw_opening": round(0.040 + math.exp(rng.uniform(math.log(0.0002), math.log(0.012))), 5),
        "duration": BELT_TIME,
    }
    lag, factor = int(rng.choice(LAGS)), math.exp(rng.uniform(0.0, math.log(LARGEST_ERROR)))
    found["estimator.systematic_std"] = round(math.hypot(Belt.systematic_std, factor * BELT_ERRORS["bias_std"]), 6)
    return found, lag, factor


def scenario_of(group, seed):
    """Returns the scenario of a run, and its lag of vision [cycles]."""
    if group == "conveyor":
        settings, lag, factor = draw_belt(seed)
        for name, usual in BELT_ERRORS.items():
            setattr(MeasuredParts, name, factor * usual)
        ArrivalsConfig.mix = BOXES_AND_DISCS
    else:
        settings, lag = draw(group, seed)
    method = "method: !SeveralObjects {}, outline: box, " if GROUPS[group] == "train:guided" else ""
    measured = f"vision=!Measured {{{method}lag_cycles: {lag}}}"
    overrides = [f"vision.lag_cycles={lag}" if group in RENDERED else measured]
    overrides += [
        f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in settings.items()
    ]
    return load_scenario(GROUPS[group], seed=seed, overrides=overrides), lag


def descents_of(scenario):
    """Returns [probability at the launch, whether the part was lifted] of each descent of a run of the conveyor."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(scenario, f"{folder}/run", RunOptions(record=False))
        diagnosis = load_log(f"{folder}/run/log.npz")["diagnosis"]
    phases = diagnosis["phase"].astype(int)
    starts = np.flatnonzero((phases[1:] == PickPhase.INTERCEPT) & (phases[:-1] == PickPhase.TRACK)) + 1
    found = []
    for start in starts:
        after = phases[start:]
        ends = np.flatnonzero((after == PickPhase.CARRY) | (after == PickPhase.RETREAT) | (after == PickPhase.WAIT))
        if len(ends):
            found.append([round(float(diagnosis["p_success"][start - 1]), 4), bool(after[ends[0]] == PickPhase.CARRY)])
    return found


def circumstances(scenario, lag):
    """Returns what a row says about its run, in SI units."""
    grasp = resolve(scenario).grasp
    return {
        "shape": scenario.track.kind,
        "speed": scenario.track.speed,
        "lag_s": round(lag / 60.0, 4),
        "room_m": round(0.5 * (grasp.jaw_opening - grasp.object_width), 5),
        "turns": grasp.turns,
    }


def run_one(job):
    """Runs one launch in a worker; returns its line, or `Lost`."""
    group, seed = job
    start = time.monotonic()
    aborts = group in THRESHOLDS
    for config, usual in ABORT.items():
        config.abort_probability = usual if aborts else 0.0
    try:
        scenario, lag = scenario_of(group, seed)
        if group == "conveyor":
            found = {"end": "over", "descents": descents_of(scenario)}
        else:
            found = {**circumstances(scenario, lag), **first_descent(scenario)}
    except DrakeTrackerError as error:
        found = {"end": "refused", "lifted": False, "said": str(error).splitlines()[0]}
    except (MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    row = {"group": group, "scenario": GROUPS[group], "seed": seed, **found}
    return {**row, "wall_s": round(time.monotonic() - start, 2)}


def describe(row):
    chance = row.get("probability")
    if "descents" in row:
        return f"conveyor, seed {row['seed']}: {sum(lifted for _, lifted in row['descents'])} of {len(row['descents'])}"
    return f"{row['group']}, seed {row['seed']}: {row['end']}" + (f" at {chance:.2f}" if chance is not None else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--group", default=",".join(GROUPS), help=f"of {', '.join(GROUPS)} (default: all)")
    parser.add_argument("--runs", type=int, help="runs of each group (default: see `RUNS`)")
    parser.add_argument("--first-seed", type=int, help="of each group (default: see `FIRST_SEEDS`)")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    done = {(row["group"], row["seed"]) for row in read_lines(options.results)}
    counts = {group: options.runs or RUNS[group] for group in options.group.split(",")}
    numbers = range(max(counts.values()))
    first = FIRST_SEEDS if options.first_seed is None else dict.fromkeys(RUNS, options.first_seed)
    jobs = [(group, first[group] + k) for k in numbers for group, count in counts.items() if k < count]
    append_results(run_one, [job for job in jobs if job not in done], options.results, options.workers, describe)


if __name__ == "__main__":
    main()
