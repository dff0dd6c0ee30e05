"""How many points of a track the estimator filtered, and why not the others."""

from collections.abc import Mapping
from typing import Any

import numpy as np

LONG_GAP = 1.0
"""Time without points after which an estimator starts again [s]."""


def count_filtered(data: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Returns the number of points, of filtered ones, and of the others by reason.

    - ``start``: the first points, from which the estimator learns speed and direction.
    - ``after_a_gap``: the same after a time without points.
    - ``after_a_jump``: the same after points that do not continue the path.

    Args:
        data: columns of the track, see `TrackTable.data`.
    """
    valid = data["valid"] > 0
    column = data["filtered_x" if "filtered_x" in data else "filtered_u"]
    stamps, filtered = data["stamp"][valid], np.isfinite(column[valid])
    counts = {"points": len(stamps), "filtered": int(filtered.sum()), "start": 0, "after_a_gap": 0, "after_a_jump": 0}
    reason = "start"
    for k, is_filtered in enumerate(filtered):
        if k and stamps[k] - stamps[k - 1] > LONG_GAP:
            reason = "after_a_gap"
        if is_filtered:
            reason = "after_a_jump"  # of the next point that is not
        else:
            counts[reason] += 1
    return counts


def describe_filtered(counts: Mapping[str, Any]) -> str:
    """Returns the numbers of `count_filtered` in one line."""
    reasons = [
        f"{counts[key]} {words}"
        for key, words in (
            ("start", "at the start"),
            ("after_a_gap", "after a gap"),
            ("after_a_jump", "after the path jumped"),
        )
        if counts[key]
    ]
    missing = f"; not filtered: {', '.join(reasons)}" if reasons else ""
    return f"{counts['filtered']} of {counts['points']}{missing}"


def describe_accuracy(numbers: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Returns (label, value with its unit) of the gap and of the error of the predictions, where they are known.

    Args:
        numbers: of a track or of an object, see `summarise_track`.
    """
    return [
        (label, f"{factor * numbers[key]:.2f} {unit}")
        for key, label, factor, unit in (
            ("gap_rms_m", "gap", 1e3, "mm"),
            ("median_speed_px_s", "median speed", 1.0, "px/s"),
            ("prediction_rms_m", "prediction rms", 1e3, "mm"),
            ("prediction_rms_px", "prediction rms", 1.0, "px"),
        )
        if numbers.get(key) is not None
    ]


def describe_object(numbers: Mapping[str, Any]) -> str:
    """Returns the numbers of one of several objects, see `summarise_track`, in one line."""
    words = [f"{numbers['points']} points from {numbers['from_s']:.2f} to {numbers['to_s']:.2f} s"]
    words += [f"{label} {text}" for label, text in describe_accuracy(numbers)]
    if numbers["hidden"]:
        words.append(f"hidden in {numbers['hidden']} images")
    return ", ".join(words)
