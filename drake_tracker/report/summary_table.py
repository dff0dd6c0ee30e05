"""The numbers of a summary in words: label, value, unit."""

_MM, _PERCENT = (1e3, "mm", 1), (100.0, "%", 1)
_SECONDS = (1.0, "s", 2)
ROWS = {
    "train": (
        ("time_to_grasp_s", "time to grasp", _SECONDS),
        ("attempts", "attempts", (1.0, "", 0)),
        ("lift_height_m", "lift height", _MM),
        ("hold_s", "held", _SECONDS),
        ("prediction_rms_m", "prediction, rms", _MM),
        ("prediction_p95_m", "prediction, 95 of 100 within", _MM),
        ("position_rms_m", "present position, rms", _MM),
        ("triangulation_rms_m", "triangulation, rms", _MM),
        ("triangulation_jitter_m", "triangulation, jitter", _MM),
        ("vision_valid_fraction", "cycles with a point", _PERCENT),
        ("closing_onset_error_s", "closing against its last instant", (1e3, "ms", 0)),
    ),
    "ball": (
        ("hand_error_m", "cup beside the ball", _MM),
        ("hold_s", "held", _SECONDS),
        ("roll_s", "roll", _SECONDS),
        ("exit_speed_m_s", "exit speed", (1.0, "m/s", 2)),
        ("position_rms_m", "position on the board, rms", _MM),
        ("vision_valid_fraction", "centroids that gave a point", _PERCENT),
    ),
}
SHARED_ROWS = (
    ("joint_limit_margin_rad", "joint limit margin", (57.29578, "°", 1)),
    ("speed_share", "greatest share of a rated speed", _PERCENT),
    ("longest_saturation_s", "longest saturation", (1e3, "ms", 0)),
    ("simulated_s", "simulated", _SECONDS),
    ("real_time_factor", "real-time factor", (1.0, "", 2)),
)


def summary_rows(summary, task):
    """Returns (label, value, unit) of what a summary has, as texts, in the order of reading."""
    rows = []
    for key, label, (factor, unit, decimals) in (*ROWS[task], *SHARED_ROWS):
        value = summary.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            rows.append((label, f"{factor * value:.{decimals}f}", unit))
    lag = summary.get("lag_s")
    if isinstance(lag, dict) and isinstance(lag.get("max"), (int, float)):
        rows.append(("lag, image to prediction", f"{1e3 * lag['max']:.1f}", "ms"))
    return rows
