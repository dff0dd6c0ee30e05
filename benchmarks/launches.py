"""Measures how often a descent that begins at a drawn time lifts the object, beside the probability computed for it.

    python benchmarks/launches.py                              every group; resumes
    python benchmarks/launches.py --group guided --runs 300    some of them

The launch gate is replaced by a drawn time, so that launches of every probability occur. Measured vision. Of each run
the first descent counts: it is a success if the jaws hold the object and have lifted it. A seed draws path, speed, lag
of vision, opening of the jaws and the time of the launch:

- ``learned``: the blind descent of `train:learned` on closed tracks;
- ``guided``: the guided descent of `train:guided`, on closed tracks and random walks, of a train or of a cube that does
  not turn;
- ``conveyor``: `conveyor:measured` for 40 s; the seed draws the belt's speed and motion, and all descents count. The
  jaws open little wider than the discs, the widest parts.

A row also has distances, curvatures and tolerances of the run. Seeds from 83000 on are for results, 82000 to 82999 for
the choice of constants. Each run becomes a line of ``results/launches.jsonl``
as soon as it ends.
"""

import argparse
import math
import os
import tempfile
import time
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from shared import common
from shared.common import append_results
from shared.stored import read_lines

from drake_tracker import load_scenario, make_diagram, simulate
from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import GraspDiagnosis, ServoTarget, Verdict
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks.train.setup import resolve

FIRST_SEED = 83000
RUNS = {"learned": 3000, "guided": 3000, "conveyor": 300}
"""{group: its runs}; a run of the conveyor has about twelve descents."""
RESULTS = common.RESULTS / "launches.jsonl"
GROUPS = {"learned": "train:learned", "guided": "train:guided", "conveyor": "conveyor:measured"}
"""{group: its scenario}."""
LAGS = (3, 6, 10, 15, 20, 25)
"""Of vision [cycles of 1/60 s]."""
PATHS = {"learned": ("oval", "stadium", "circle"), "guided": ("oval", "stadium", "circle", "random_walk")}
"""{group: the shapes of its tracks}."""
LATEST = {False: 12.0, True: 3.0}
"""{whether the track ends: longest time above the object before the launch [s]}; closed paths are learned in a lap."""
BELT_TIME = 40.0
"""Duration of a run of the conveyor [s]."""
LONGEST = 60.0
"""Simulated time [s] after which a run without a launch ends."""


def draw(group, seed):
    """Returns the settings of a run, {key: value}."""
    rng = np.random.default_rng([seed, 83])
    shape = str(rng.choice(PATHS[group]))
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
    if group == "guided" and rng.uniform() < 0.4:
        found |= {"train.body": "cube", "track.turns": False}
    return found, int(rng.choice(LAGS))


def draw_belt(seed):
    """Returns the settings of a run of the conveyor, and its lag of vision [cycles]."""
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
    return found, int(rng.choice(LAGS))


def scenario_of(group, seed):
    """Returns the scenario of a run, and its lag of vision [cycles]."""
    settings, lag = draw_belt(seed) if group == "conveyor" else draw(group, seed)
    method = "method: !SeveralObjects {}, outline: box, " if group == "guided" else ""
    overrides = [f"vision=!Measured {{{method}lag_cycles: {lag}}}"]
    overrides += [
        f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in settings.items()
    ]
    return load_scenario(GROUPS[group], seed=seed, overrides=overrides), lag


def first_descent(scenario):
    """Returns what the first descent of a run came to: {"launch_s", "probability", "lifted", "end"}, the first two None
    without a launch."""
    diagram = make_diagram(scenario)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagnosis = lambda: GraspDiagnosis(diagram.GetOutputPort("diagnosis").Eval(context))  # noqa: E731
    verdict = lambda: Verdict(diagram.GetOutputPort("truth_verdict").Eval(context))  # noqa: E731
    launch, probability, target = None, None, None
    before = 0.0
    while context.get_time() < scenario.duration:
        simulator.AdvanceTo(min(context.get_time() + SERVO_PERIOD, scenario.duration))
        seen = diagnosis()
        phase = Phase(int(seen.phase))
        if launch is None and phase == Phase.INTERCEPT:
            launch, probability = context.get_time(), before
            target = ServoTarget(diagram.GetOutputPort("target").Eval(context))
        if launch is not None and phase in (Phase.RETREAT, Phase.HOLD, Phase.ACQUIRE):
            end = "lifted" if phase == Phase.HOLD and verdict().held else "missed"
            return {
                "launch_s": round(launch, 2),
                "age_s": round(float(target.time - target.stamp), 4),
                "probability": round(float(probability), 4),
                "lifted": end == "lifted",
                "end": end,
            }
        if verdict().derailed:
            break
        before = float(seen.p_success)
    end = "derailed" if verdict().derailed else "no launch" if launch is None else "ended"
    found = {"launch_s": None, "age_s": None, "probability": None, "lifted": False, "end": end}
    if launch is not None:
        found |= {"launch_s": round(launch, 2), "probability": round(float(probability), 4)}
    return found


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


def features(scenario, lag):
    """Returns what the success law rests on, in SI units."""
    setup = resolve(scenario)
    track, _ = setup.placement
    s = np.linspace(0.0, track.length, 400, endpoint=not track.closed)
    bend = track.curvature(s)
    grasp = setup.grasp
    return {
        "speed": scenario.track.speed,
        "lag_s": lag / 60.0,
        "room_m": 0.5 * (grasp.jaw_opening - grasp.object_width),
        "reach_m": grasp.reach,
        "turns": grasp.turns,
        "curvature_rms": round(float(np.sqrt(np.mean(bend**2))), 3),
        "curvature_max": round(float(np.max(np.abs(bend))), 3),
        "surprise_m": {str(d): round(surprise(track, s, d), 5) for d in (0.02, 0.05, 0.1, 0.15)},
        "shape": scenario.track.kind,
    }


def surprise(track, s, distance):
    """Returns the rms distance [m] at which the track is, ``distance`` [m] ahead, from an arc that continues it."""
    if not track.closed:
        s = s[s < track.length - distance]
    x, y, heading = track.pose(s)
    bend = track.curvature(s)
    turn = bend * distance
    chord = distance * np.sinc(0.5 * turn / np.pi)
    ahead = np.column_stack([x + chord * np.cos(heading + 0.5 * turn), y + chord * np.sin(heading + 0.5 * turn)])
    there = np.column_stack(track.pose(s + distance)[:2])
    return float(np.sqrt(np.mean(np.sum((ahead - there) ** 2, axis=1))))


def run_one(job):
    """Runs one launch in a worker; returns its line, or `Lost`."""
    group, seed = job
    start = time.monotonic()
    try:
        scenario, lag = scenario_of(group, seed)
        if group == "conveyor":
            found = {"end": "over", "descents": descents_of(scenario)}
        else:
            found = {**features(scenario, lag), **first_descent(scenario)}
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
    parser.add_argument("--runs", type=int, help="runs of each group (default: 3,000, of the conveyor 300)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    done = {(row["group"], row["seed"]) for row in read_lines(options.results)}
    counts = {group: options.runs or RUNS[group] for group in options.group.split(",")}
    numbers = range(max(counts.values()))
    jobs = [(group, options.first_seed + k) for k in numbers for group, count in counts.items() if k < count]
    append_results(run_one, [job for job in jobs if job not in done], options.results, options.workers, describe)


if __name__ == "__main__":
    main()
