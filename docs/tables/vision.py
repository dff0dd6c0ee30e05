"""Measured vision beside cameras (`results/measured_vision.jsonl`), the cameras' bias, and Singh's image flow
(`results/singh_flow.json`)."""

import numpy as np
import yaml
from measured_vision import PLAIN, cells_table, compare, key_of
from shared.common import RESULTS, interval
from singh_flow import NORMAL_HULL, methods_table

from tables.results import Row, block, commit_of, data, lines, origin, ranges, seeds_between, table, where

_FIT = RESULTS.parents[1] / "drake_tracker" / "tasks" / "train" / "train_vision.yaml"
_FIT_COMMIT = "b098b85"
"""The commit that stored the fit (git log --follow)."""
_SHOWN_SPEEDS = (0.10, 0.15, 0.20, 0.60)
_BEND_RADIUS = 0.12
_KINDS = ("cameras", "measured")
_ORDER = ("closed_path", "coordinated_turn", "arc_length", "alpha_beta_gamma")


def compared(first: int = 0, last: int = 1000) -> list[Row]:
    """Returns what the benchmark's `compare` says about the seeds from ``first`` to ``last``."""
    chosen = seeds_between(first, last)
    cameras = [row for row in where(lines("train_grasp"), seed=chosen) if row["cell"] in PLAIN]
    found = compare(cameras, where(lines("measured_vision"), seed=chosen))
    return sorted(found, key=lambda entry: _ORDER.index(entry["estimator"]))


def measured_vision() -> str:
    rates, medians = [], []
    for first, last in ((500, 523), (200, 219)):
        for entry in where(compared(first, last), cell="all"):
            own = where(lines("measured_vision"), estimator=entry["estimator"], seed=seeds_between(first, last))
            seeds = ranges(row["seed"] for row in own)
            runs, counts = entry["runs"], [entry[f"{name}_success_count"] for name in _KINDS]
            lifted = [f"{count} ({interval(count, runs)})" for count in counts]
            rates.append([entry["estimator"], seeds, runs, *lifted, f"{entry['difference_points']:+.0f}"])
            errors = [
                f"{1e3 * entry[f'{name}_{what}']:.2f} mm"
                for what in ("triangulation_jitter_m", "prediction_rms_m")
                for name in _KINDS
            ]
            medians.append([entry["estimator"], seeds, *errors])
    header = ["estimator", "seeds", "runs", "lifted with cameras", "with measured vision", "difference [points]"]
    more = ["estimator", "seeds", "jitter of a point, cameras", "measured vision"]
    return block(
        table(header, rates),
        origin(lines("measured_vision"), "Wilson 95 % intervals in brackets."),
        "Medians over the runs of the jitter of a triangulated point and of the rms prediction error:",
        table([*more, "prediction error, cameras", "measured vision"], medians),
    )


def measured_vision_cells() -> str:
    found = [entry for entry in compared() if entry["cell"] != "all"]
    mixed = [entry for entry in found if any(entry[f"{name}_success_count"] < entry["runs"] for name in _KINDS)]
    text = (
        f"In {len(found) - len(mixed)} of {len(found)} cells, all trains were lifted with both kinds of vision. The "
        "others (Wilson 95 % intervals in brackets):"
    )
    header, rows = cells_table(mixed)
    return block(text, table(header[:6], [row[:6] for row in rows]))


def measured_vision_failures() -> str:
    cameras = {key_of(row): row for row in lines("train_grasp")}
    rows = []
    for row in lines("measured_vision"):
        with_cameras = cameras[key_of(row)]
        if bool(row["success"]) != bool(with_cameras["success"]):
            failed = with_cameras if row["success"] else row
            kind = "cameras" if row["success"] else "measured vision"
            commit = f"`{commit_of(failed)}`"
            rows.append([row["estimator"], row["cell"], row["seed"], kind, commit, failed["failure_reason"]])
    return table(["estimator", "cell", "seed", "failed with", "commit", "reason"], rows)


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
