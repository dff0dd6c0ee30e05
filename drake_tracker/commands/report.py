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


def report(scenario, summary, out):
    """Prints a run's summary, and its directory ``out``. Returns the exit code."""
    for key, label, unit in _RESULT_ROWS[scenario.task]:
        if summary.get(key) is not None:
            values = summary[key] if isinstance(summary[key], list) else [summary[key]]
            words = ", ".join(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values)
            print(f"{label:<18}{words} {unit}".rstrip())
    print(f"{'run directory':<18}{out}")
    if summary.get("interrupted"):
        return INTERRUPTED
    return SUCCESS if summary["success"] else NOT_TAKEN
