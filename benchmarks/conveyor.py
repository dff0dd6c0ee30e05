"""Measures the conveyor task, part by part.

    python benchmarks/conveyor.py                    all parts, on two processes; resumes
    python benchmarks/conveyor.py --part load        one part
    python benchmarks/conveyor.py --part load --cells "even with cameras"
    python benchmarks/conveyor.py --quick            a trial on seeds of its own; nothing is written to the results

- capacity: parts are always waiting (48 arrive per minute). How many does the arm pick per minute?
- load: parts arrive at 80 % of the capacity, evenly, as from a feeder, or independently of each other. How many are
  missed, dropped, misplaced, picked in pairs, and how well do they lie in their cells? With measured vision, with
  cameras, with an encoder, and with a second arm.
- saturated: parts arrive singly and in bunches, more than the arm can pick. What share of the bound does each
  dispatcher reach, and how much more does it pick than first in first out?
- map: speeds of the belt and rates of arrival, at the highest rate with an encoder, too.
- stop: the belt stops and goes, or has two speeds.
- incline: a belt that rises beside a level one, with the same parts.
- speed: how fast is the whole loop with cameras and about six parts in view? Only with `--part speed`, on a quiet
  machine.

Every run has 60 s. The clairvoyant bound, the largest number of picks of an arm that knows all arrivals, is computed
with the time of a cycle that the dispatcher expects. Images are rendered in the cells with cameras only. Seeds 5000 to
5499 are used nowhere else.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from result_tables.conveyor_tables import TABLES
from shared import common, parts
from shared.parts import Part, Timed

from drake_tracker import simulate
from drake_tracker.campaign.rates import wilson
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks import load_scenario
from drake_tracker.world.conveyor.part_fates import PartFate

RESULTS = common.RESULTS / "conveyor.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "conveyor"
DURATION = 60.0
PUMA, UR5E, CAMERAS = "conveyor:measured", "conveyor:ur5e_measured", "conveyor"
"""Scenarios with the arms, each with the cycle of its arm, and with cameras, which the waiting hand does not cover."""
WAITING = 48.0
"""Rate at which parts are always waiting [1/min]."""
LOAD = 16.0
"""80 % of 20 picks a minute, about the capacity of the PUMA 560 on a belt at 0.15 m/s [1/min]."""
EVEN = "arrivals.pattern=even"


def settings(speed, rate, *others, scenario=PUMA):
    """Returns the scenario of a cell, and a list of settings."""
    return scenario, [f"belt.speed={speed}", f"arrivals.rate={rate}", *others]


CAPACITY = {
    **{f"belt {speed} m/s": settings(speed, WAITING) for speed in (0.10, 0.15, 0.25)},
    "belt 0.15 m/s with the UR5e": settings(0.15, WAITING, scenario=UR5E),
    "belt 0.15 m/s with cameras": settings(0.15, WAITING, scenario=CAMERAS),
}
LOADED = {
    "even": settings(0.15, LOAD, EVEN),
    "even with cameras": settings(0.15, LOAD, EVEN, scenario=CAMERAS),
    "even with encoder": settings(0.15, LOAD, EVEN, "belt.encoder=true"),
    "even with UR5e": settings(0.15, LOAD, EVEN, scenario=UR5E),
    "independent": settings(0.15, LOAD),
    "independent with cameras": settings(0.15, LOAD, scenario=CAMERAS),
}
DISPATCHERS = {
    "look ahead": "!LookAhead {}",
    "greedy": "!Greedy {}",
    "nearest deadline": "!NearestDeadline {}",
    "first in first out": "!FirstInFirstOut {}",
}
PATTERNS = {"singly": [], "bunches of 4": ["arrivals.pattern=bunches", "arrivals.bunch_size=4"]}
SATURATED = {
    f"{pattern}: {name}": settings(0.10, WAITING, *PATTERNS[pattern], f"dispatch={kind}")
    for pattern in PATTERNS
    for name, kind in DISPATCHERS.items()
}
MAP_SPEEDS, MAP_RATES = (0.05, 0.10, 0.15, 0.20, 0.30, 0.40), (6.0, 12.0, 18.0)
MAP = {f"{speed:.2f} m/s and {rate:.0f} a minute": settings(speed, rate) for speed in MAP_SPEEDS for rate in MAP_RATES}
MAP |= {
    f"{speed:.2f} m/s and {MAP_RATES[-1]:.0f} a minute with encoder": settings(
        speed, MAP_RATES[-1], "belt.encoder=true"
    )
    for speed in MAP_SPEEDS
}
STOP = {
    f"{motion.replace('_', ' ')}{' with ' + name if name else ''}": settings(
        0.15, 12.0, EVEN, f"belt.motion={motion}", *others, scenario=CAMERAS if name == "cameras" else PUMA
    )
    for motion in ("stop_and_go", "two_speed")
    for name, others in {"": [], "encoder": ["belt.encoder=true"], "cameras": []}.items()
}
INCLINE = {
    "level belt": settings(0.15, LOAD, EVEN),
    "belt rises by 10 deg": settings(0.15, LOAD, EVEN, "belt.incline_deg=10"),
}
SLOW, FAST = ["belt.speed=0.05", "arrivals.rate=32"], ["belt.speed=0.1", "arrivals.rate=47"]
"""Settings with which about six parts are in view on average."""
SPEED = {
    "0.10 m/s, cameras": ("conveyor", FAST),
    "0.10 m/s, cameras, each image looked at": ("conveyor", [*FAST, "vision.update_cycles=1"]),
    "0.10 m/s, measured vision": ("conveyor:measured", [*FAST, "window.y_wait=-0.10"]),
    "0.05 m/s, cameras": ("conveyor", SLOW),
    "0.05 m/s, measured vision": ("conveyor:measured", [*SLOW, "window.y_wait=-0.10"]),
}
"""The loops whose speeds are compared."""
CELLS = {**CAPACITY, **LOADED, **SATURATED, **MAP, **STOP, **INCLINE}
KEPT = (
    "success", "could_be_picked", "placed_of_these", "arrived", "picked", "placed", "missed", "dropped", "doubles",
    "misplaced", "picks_per_minute", "share_of_clairvoyant", "placement_rms_m", "placement_turn_rms_rad",
    "missed_because", "belt_touched", "tray_touched", "table_touched", "self_touched", "joint_limit_margin_rad",
    "speed_share", "longest_saturation_s", "set_points_changed", "failure_reason",
)  # fmt: skip
"""What the line of a run keeps of its summary."""


def job(cell, seed, quick):
    """Returns the line of a run."""
    name, overrides = CELLS[cell]
    scenario = load_scenario(name, seed=seed, duration=12.0 if quick else DURATION, overrides=overrides)
    with tempfile.TemporaryDirectory() as folder:
        summary = simulate(scenario, out=f"{folder}/run", options=RunOptions(record=False))
    return {key: summary[key] for key in KEPT}


def available(cells):
    """Returns those cells whose settings exist."""
    found = []
    for cell in cells:
        try:
            name, overrides = CELLS[cell]
            load_scenario(name, overrides=overrides)
            found.append(cell)
        except DrakeTrackerError as error:
            print(f"{cell}: left out ({str(error).splitlines()[0]})", file=sys.stderr)
    return found


def rate_of(rows, key, over):
    """Returns [sum of a count, sum of another, Wilson interval of their ratio] over all runs."""
    count, total = sum(row[key] for row in rows), sum(row[over] for row in rows)
    return [count, total, *wilson(min(count, total), total)] if total else [count, 0, 0.0, 1.0]


def mean_of(rows, key):
    """Returns the mean of a number over all runs that have it, with its bootstrap interval; None without any."""
    values = np.array([row[key] for row in rows if row[key] is not None], float)
    if not len(values):
        return None
    means = np.random.default_rng(0).choice(values, (2000, len(values))).mean(axis=1)
    return [float(value) for value in (values.mean(), *np.quantile(means, (0.025, 0.975)))]


def rms_of(rows, key):
    """Returns the root mean square over all placed parts, None without any."""
    pairs = [(row[key], row["placed"]) for row in rows if row[key] is not None]
    total = sum(count for _, count in pairs)
    return float(np.sqrt(sum(value**2 * count for value, count in pairs) / total)) if total else None


def summary(rows):
    """Returns the results of a cell."""
    possible = [{**row, "lost": row["could_be_picked"] - row["placed_of_these"]} for row in rows]
    causes = sum((Counter(row["missed_because"]) for row in rows), Counter())
    return {
        "runs": len(rows),
        "succeeded": sum(row["success"] for row in rows),
        "picks_per_minute": mean_of(rows, "picks_per_minute"),
        "share_of_clairvoyant": mean_of(rows, "share_of_clairvoyant"),
        "lost": rate_of(possible, "lost", "could_be_picked"),
        "dropped": rate_of(rows, "dropped", "picked"),
        "misplaced": rate_of(rows, "misplaced", "placed"),
        "doubles": sum(row["doubles"] for row in rows),
        "placement_rms_m": rms_of(rows, "placement_rms_m"),
        "placement_turn_rms_rad": rms_of(rows, "placement_turn_rms_rad"),
        "touched": sum(row[key] for row in rows for key in ("belt_touched", "tray_touched", "table_touched")),
        "missed_because": dict(causes.most_common()),
    }


def part(cells, count, first_seed, name, **others):
    """Returns a part of this benchmark: ``count`` runs of each cell, or those in ``others`` for the end of its name."""
    counts = {cell: next((number for end, number in others.items() if cell.endswith(end)), count) for cell in cells}
    return Part(job, counts, first_seed, summary, TABLES[name], available)


def in_view(log, belt):
    """Returns the mean number of parts on the belt between its entry and its end, after the first 10 s."""
    states, fates = log["truth_part_states"], log["truth_fates"]
    rows = np.searchsorted(states.times, fates.times, side="right") - 1
    y = states.data[rows, 5::13]
    seen = np.isin(fates.data, (PartFate.UPSTREAM, PartFate.ON_BELT)) & (y >= belt.entry) & (y <= belt.end)
    return float(seen.sum(axis=1)[fates.times >= 10.0].mean())


def speed(seed, quick):
    """Returns the results of the speed: how many times faster than real time each loop is."""
    cells = []
    for cell, (name, settings) in SPEED.items():
        scenario = load_scenario(name, seed=seed, duration=12.0 if quick else DURATION, overrides=settings)
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "run"
            factor = simulate(scenario, out=out, options=RunOptions(record=False))["real_time_factor"]
            cells.append(
                {"cell": cell, "runs": 1, "real_time_factor": factor, "in_view": in_view(load_log(out), scenario.belt)}
            )
    return cells


PARTS = {
    "capacity": part(CAPACITY, 20, 5000, "capacity"),
    "load": part(LOADED, 40, 5100, "load", cameras=20, encoder=20, UR5e=20),
    "saturated": part(SATURATED, 20, 5200, "saturated"),
    "map": part(MAP, 20, 5300, "map"),
    "stop": part(STOP, 20, 5400, "stop"),
    "incline": part(INCLINE, 20, 5440, "incline"),
    "speed": Timed(speed, 5490, TABLES["speed"]),
}


if __name__ == "__main__":
    parts.main(__doc__, PARTS, FOLDER, RESULTS)
