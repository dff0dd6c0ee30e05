"""The report that is printed, and shown on the live view, when a run has ended."""

import sys
from pathlib import Path
from typing import Any

from drake_tracker.commands.common import NOT_TAKEN, SUCCESS
from drake_tracker.core.processes.signals import exit_code
from drake_tracker.core.progress import coloured
from drake_tracker.core.timing import SERVO_PERIOD

_SHOWN = {"m": (1e3, "mm", 1), "s": (1.0, "s", 2), "rad": (57.29578, "°", 2), "%": (100.0, "%", 0)}
"""{unit of the summary: (factor, unit on the screen, decimals)}."""


def report(scenario: Any, summary: dict[str, Any], out: Path) -> int:
    """Prints the summary of a run and its directory. Returns the exit code."""
    for key, label, text in _rows(scenario, summary):
        print(f"{label:<18}{coloured(text, bool(summary[key]), sys.stdout) if key == 'success' else text}")
    print(f"{'run directory':<18}{out}")
    print(f"{'next':<18}drake-tracker view {out}")
    if summary.get("interrupted"):
        return exit_code()
    return SUCCESS if summary["success"] else NOT_TAKEN


def outcome(scenario: Any, summary: dict[str, Any], out: Path) -> dict[str, Any]:
    """Returns the outcome of a run for the page of the live view, see `LiveView.finish`."""
    from drake_tracker.tasks.registry import task_of

    success = bool(summary["success"])
    rows = _rows(scenario, summary)
    return {
        "success": success,
        "title": task_of(scenario).titles[success],
        "reason": summary.get("failure_reason"),
        "rows": [(label, text) for key, label, text in rows if key not in ("success", "failure_reason")],
        "out": str(out),
    }


def _rows(scenario: Any, summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Returns (key, label, value with its unit) of those results of the task that the summary has.

    Each trouble with the tracking of several objects has a separate row.
    """
    from drake_tracker.tasks.registry import task_of

    rows = []
    task = task_of(scenario)
    for key, label, unit in task.result_rows:
        if summary.get(key) is not None:
            values = summary[key] if isinstance(summary[key], list) else [summary[key]]
            units = unit.split(", ")
            text = ", ".join(
                _shown(value, unit) for value, unit in zip(values, units if units[1:] else units * len(values))
            )
            if key == "success":
                code = SUCCESS if summary[key] else NOT_TAKEN
                title = task.titles[bool(summary[key])]
                text += f": {title[0].lower()}{title[1:]} (exit code {code})"
            lag = (summary.get("lag_s") or {}).get("max")
            if key == "prediction_rms_m" and lag is not None:  # the servo looks ahead by two periods more
                text += f", {lag + 2.0 * SERVO_PERIOD:.2f} s ahead"
            rows.append((key, label, text))
    return rows + [("tracking", "tracking", trouble) for trouble in summary.get("tracking", {}).get("sentences", ())]


def _shown(value: Any, unit: str) -> str:
    """Returns a value of the summary with its unit, as a person reads it."""
    if not isinstance(value, float):
        return f"{value} {unit}".rstrip()
    factor, shown, decimals = _SHOWN.get(unit, (1.0, unit, 2))
    return f"{factor * value:.{decimals}f} {shown}".rstrip()
