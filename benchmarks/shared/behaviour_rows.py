"""Which packaged scenarios the results of each benchmark rest on, and which results are of another behaviour.

Every result carries ``behaviour``: {packaged scenario: number of its behaviour when it was measured}. The number is
None where an old result cannot be assigned to one. A result without scenarios (synthetic worlds, clips) carries {}.
"""

import json
from functools import cache
from pathlib import Path

from shared.stored import read_lines

RECORDS = Path(__file__).parents[1] / "behaviour.json"


def _of_parts(**parts):
    return lambda result: parts[result["part"]]


_GUIDED, _LEARNED, _BALL = ("train:guided",), ("train:learned",), ("ball",)
_LADDER = ("train", *_LEARNED, *_GUIDED, "train:wrist", "train:two", "train:visitor", "train:interlaced")
_CONVEYOR = ("conveyor", "conveyor:measured", "conveyor:ur5e_measured")
RESTS_ON = {
    "autopsy": _LEARNED,
    "ball": lambda row: ("ball:seven_joint",) if row["cell"].startswith("seven_joint") else _BALL,
    "ball_camera": _BALL,
    "ball_detectors": (*_BALL, *_LEARNED),
    "camera_motion": _LEARNED,
    "campaign_speed": _LEARNED,
    "centroid_speed": _LEARNED,
    "conveyor": _CONVEYOR,
    "conveyor_vision": ("conveyor",),
    "crossing_tracks": (),
    "dispatch": (),
    "environment_speed": (),
    "estimation": (),
    "run": (),  # estimation/run.py
    "eyes_open": _of_parts(
        event=(*_LEARNED, *_GUIDED),
        calm=(*_LEARNED, *_GUIDED),
        hand=_GUIDED,
        wrist=("train:wrist", *_GUIDED),
        **{"pass": _GUIDED},
    ),
    "faults": lambda row: (row.get("scenario", "train:learned"),),
    "footage": (),
    "fuzz": (),
    "hard_paths": lambda row: (row["scenario"],),
    "imitation": _GUIDED,
    "space_filter": (),
    "latency": (),
    "latency_curve": lambda row: (row["scenario"],),
    "launches": lambda row: (row["scenario"],),
    "success_law": lambda row: (row["scenario"],),
    "live_cost": _LEARNED,
    "measured_vision": lambda row: (row["scenario"],),
    "rivals": lambda row: (row["scenario"],),
    "real_time": (*_LADDER, *_BALL, "conveyor"),
    "speed_watch": _LADDER,
    "mutations": (),
    "renderers": (),
    "second_attempts": _LEARNED,
    "several": _of_parts(
        separation=_GUIDED,
        passing=_GUIDED,
        coverage=(*_GUIDED, "train:visitor"),
        lift=(*_GUIDED, "train:two", "train:visitor"),
        cameras=_GUIDED,
        shake=_GUIDED,
        cost=(*_GUIDED, "train:two"),
    ),
    "paper_figures": ("train",),
    "singh_flow": _LEARNED,
    "start_up": ("train", *_LEARNED),
    "terminations": ("train",),
    "tracking": ("train",),
    "train_grasp": lambda row: (row["scenario"],),
}
"""{benchmark: the scenarios that its results rest on, or a function of a result that returns them}."""


@cache
def behaviour_records():
    """Returns {packaged scenario: its record}, as `behaviour.py` wrote it."""
    return json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.exists() else {}


def rests_on(benchmark, result):
    """Returns the scenarios that a result of a benchmark rests on. Raises KeyError for an unknown benchmark."""
    found = RESTS_ON[benchmark]
    return found(result) if callable(found) else found


def behaviour_of(benchmark, result):
    """Returns ``{"behaviour": {scenario: its number today}}`` of a new result; {} outside of benchmarks."""
    if benchmark not in RESTS_ON:
        return {}
    records = behaviour_records()
    return {"behaviour": {name: records[name]["number"] for name in rests_on(benchmark, result)}}


def other_behaviours(result):
    """Returns the scenarios of which a result, or what made it, rests on another behaviour than today's."""
    records = behaviour_records()
    return [name for name, number in _numbers(result).items() if records[name]["number"] != number]


def is_current(result):
    """Returns whether a result rests on today's behaviour only."""
    return not other_behaviours(result)


def _numbers(result):
    made_by = result.get("made_by", result)
    return made_by.get("behaviour", {}) if isinstance(made_by, dict) else {}


def results_of(path):
    """Returns the results of a file: its lines or parts, or the whole file. Each carries its behaviour."""
    made_by = sidecar(path)
    if path.suffix == ".jsonl":
        rows = read_lines(path)
        return [{"behaviour": made_by["behaviour"], **row} for row in rows] if "behaviour" in made_by else rows
    found = json.loads(path.read_text(encoding="utf-8"))
    if isinstance(found, list) and "made_by" in found[0]:
        return found
    if isinstance(found, list) or "made_by" not in found:
        return [made_by]
    return found["made_by"] if isinstance(found["made_by"], list) else [found]


def sidecar(path):
    """Returns what NAME.meta.json says about the result file NAME; empty without one."""
    beside = path.parent / f"{path.stem}.meta.json"
    return json.loads(beside.read_text(encoding="utf-8")) if beside.exists() else {}
