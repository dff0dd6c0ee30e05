"""What is said of a run when it has ended."""

from drake_tracker.commands.common import INTERRUPTED, NOT_TAKEN, SUCCESS

_RESULT_ROWS = {
    "train": (
        ("success", "success", ""),
        ("failure_reason", "reason", ""),
        ("attempts", "attempts", ""),
        ("time_to_grasp_s", "time to grasp", "s"),
        ("lift_height_m", "lift height", "m"),
        ("hold_s", "held", "s"),
        ("prediction_rms_m", "prediction rms", "m"),
        ("real_time_factor", "real-time factor", ""),
    ),
    "ball": (
        ("success", "caught", ""),
        ("failure_reason", "reason", ""),
        ("hand_error_m", "hand error", "m"),
        ("hold_s", "held", "s"),
        ("position_rms_m", "position rms", "m"),
        ("board_in_camera_error", "board in camera", "m, rad"),
        ("board_in_world_error", "board in world", "m, rad"),
        ("real_time_factor", "real-time factor", ""),
    ),
}
"""What is printed of a task's summary: key, label, unit."""
_TITLES = {
    "train": ("The train was not lifted", "The train was lifted"),
    "ball": ("The ball was not caught", "The ball was caught"),
}
"""How the live view says that a task failed, or succeeded."""


def report(scenario, summary, out):
    """Prints a run's summary, and its directory ``out``. Returns the exit code."""
    for _, label, words in _rows(scenario, summary):
        print(f"{label:<18}{words}")
    print(f"{'run directory':<18}{out}")
    print(f"{'look at it':<18}drake-tracker view {out}")
    if summary.get("interrupted"):
        return INTERRUPTED
    return SUCCESS if summary["success"] else NOT_TAKEN


def outcome(scenario, summary, out):
    """Returns what the live view says of a run that has ended; see `LiveView.finish`."""
    success = bool(summary["success"])
    rows = _rows(scenario, summary)
    return {
        "success": success,
        "title": _TITLES[scenario.task][success],
        "reason": summary.get("failure_reason"),
        "rows": [(label, words) for key, label, words in rows if key not in ("success", "failure_reason")],
        "out": str(out),
    }


def _rows(scenario, summary):
    """Returns a list of (key, label, value with its unit) of what a summary has."""
    rows = []
    for key, label, unit in _RESULT_ROWS[scenario.task]:
        if summary.get(key) is not None:
            values = summary[key] if isinstance(summary[key], list) else [summary[key]]
            words = ", ".join(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values)
            rows.append((key, label, f"{words} {unit}".rstrip()))
    return rows
