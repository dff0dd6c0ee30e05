"""What is printed, and shown on the live view, when a run has ended."""

from pathlib import Path
from typing import Any

from drake_tracker.commands.common import NOT_TAKEN, SUCCESS
from drake_tracker.core.processes.signals import exit_code


def report(scenario: Any, summary: dict[str, Any], out: Path) -> int:
    """Prints the summary of a run and its directory. Returns the exit code."""
    for _, label, text in _rows(scenario, summary):
        print(f"{label:<18}{text}")
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

    Each trouble with the tracking of several objects has a row of its own.
    """
    from drake_tracker.tasks.registry import task_of

    rows = []
    for key, label, unit in task_of(scenario).result_rows:
        if summary.get(key) is not None:
            values = summary[key] if isinstance(summary[key], list) else [summary[key]]
            text = ", ".join(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values)
            rows.append((key, label, f"{text} {unit}".rstrip()))
    return rows + [("tracking", "tracking", trouble) for trouble in summary.get("tracking", {}).get("sentences", ())]
