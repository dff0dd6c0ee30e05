"""The numbers of a summary as texts: label, value, unit."""

from collections.abc import Mapping, Sequence
from typing import Any

from drake_tracker.arm.safety.packet_guard import REASONS
from drake_tracker.tasks.task import SummaryRow

SHARED_ROWS: tuple[SummaryRow, ...] = (
    ("joint_limit_margin_rad", "joint limit margin", (57.29578, "°", 1)),
    ("speed_share", "largest fraction of a rated speed", (100.0, "%", 1)),
    ("longest_saturation_s", "longest saturation", (1e3, "ms", 0)),
    ("simulated_s", "simulated time", (1.0, "s", 2)),
    ("real_time_factor", "real-time factor", (1.0, "", 2)),
)
"""Rows for every task, after the task's own."""


def summary_rows(summary: Mapping[str, Any], rows: Sequence[SummaryRow]) -> list[tuple[str, str, str]]:
    """Returns (label, value, unit) of the numbers that a summary has, in reading order.

    Rejected packets have a row for each reason for which there were any.

    Args:
        summary: of a run.
        rows: of the task, `Task.summary_rows`.
    """
    found = []
    for key, label, (factor, unit, decimals) in (*rows, *SHARED_ROWS):
        value = summary.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            found.append((label, f"{factor * value:.{decimals}f}", unit))
    counts = summary.get("packets_rejected_for")
    if isinstance(counts, dict):
        for reason, words in REASONS.items():
            count = counts.get(reason.name.lower())
            if count:
                found.append((f"packets rejected: {words}", f"{count:.0f}", ""))
    lag = summary.get("lag_s")
    if isinstance(lag, dict) and isinstance(lag.get("max"), (int, float)):
        found.append(("lag from the stamp of a point to its prediction", f"{1e3 * lag['max']:.1f}", "ms"))
    return found
