"""Measured vision beside cameras (`results/measured_vision.jsonl`), the cameras' bias, and Singh's image flow
(`results/singh_flow.json`)."""

import numpy as np
import yaml
from measured_vision import key_of, pairs_of, vision_table
from shared.common import RESULTS
from singh_flow import NORMAL_HULL, methods_table

from tables.results import Row, block, commit_of, data, lines, origin, ranges, table, uses

_FIT = RESULTS.parents[1] / "drake_tracker" / "tasks" / "train" / "train_vision.yaml"
_FIT_COMMIT = "b098b85"
"""The commit that stored the fit (git log --follow)."""
_SHOWN_SPEEDS = (0.10, 0.15, 0.20, 0.60)
_BEND_RADIUS = 0.12


def measured_vision() -> str:
    pairs = pairs_of(lines("train_grasp"), lines("measured_vision"))
    uses(*(cameras for cameras, _ in pairs))
    rows = []
    for cameras, measured in pairs:
        if bool(measured["success"]) != bool(cameras["success"]):
            kind, failed = ("cameras", cameras) if measured["success"] else ("measured vision", measured)
            scenario, cell, seed = key_of(failed)
            rows.append([f"`{scenario}`", cell, seed, kind, f"`{commit_of(failed)}`", failed["failure_reason"]])
    return block(
        table(*vision_table(pairs)),
        origin([measured for _, measured in pairs]),
        "Runs that only one kind of vision lifted:",
        table(["scenario", "cell", "seed", "failed with", "commit", "reason"], rows),
    )


def camera_bias() -> str:
    fit = yaml.safe_load(_FIT.read_text(encoding="utf-8"))
    rows = []
    for entry in fit["speeds"]:
        if entry["speed"] in _SHOWN_SPEEDS:
            rms, mean = _over_headings(entry)
            cells = [f"{1e3 * a:.1f} mm ({1e3 * b:+.1f})" for a, b in zip(rms, mean)]
            rows.append([f"{entry['speed']:.2f} m/s", *(cells[k] for k in (0, 1, 3, 2))])
    header = ["speed", "along", "across, on a straight", "across, inwards in a bend of 0.12 m", "vertical"]
    notes = fit["notes"]
    text = f"Seeds 0 to {notes['seeds'] - 1}, {notes['laps']} laps per speed and seed, commit `{_FIT_COMMIT}`."
    return block(table(header, rows), f"*Rms over all headings, mean in brackets. {text}*")


def singh_flow() -> str:
    found = data("singh_flow")
    made_by, images = found["made_by"], found["methods"][NORMAL_HULL]["images"]
    text = f"Seeds {ranges(made_by['seeds'])}, commit `{made_by['commit'][:7]}`, {images} positions."
    return block(
        table(*methods_table(found["methods"])),
        f"*{text} In brackets: 95 % intervals, from a bootstrap over the laps.*",
    )


def _over_headings(entry: Row) -> tuple[list[float], list[float]]:
    """Returns rms and mean [m] over all headings: along, across, vertical, across inwards in a bend."""
    straight = {axis: np.array(values) for axis, values in entry["bias_straight"].items()}
    bend = np.array(entry["bias_per_curvature"]["across"]) / _BEND_RADIUS
    inwards = np.concatenate([straight["across"] + bend, bend - straight["across"]])
    parts = [straight["along"], straight["across"], straight["vertical"], inwards]
    return [float(np.sqrt(np.mean(part**2))) for part in parts], [float(np.mean(part)) for part in parts]
