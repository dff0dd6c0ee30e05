"""The tables of `tracking.py`, from its results."""

HEADING_BINS = 12


def share(value):
    """Returns a fraction as a percentage."""
    return f"{100 * value:.1f} %"


def change(found):
    """Returns the change of a quantity with its interval and the scatter of single laps as a text."""
    texts = [] if found is None else [f"{100 * value:{sign}.1f} %" for value, sign in zip(found, ("+", "", ""))]
    return "{} +- {} (single laps: {})".format(*texts) if texts else ""


ROWS = (
    ("laps", "laps", ".1f"),
    ("hand tracks from [s]", "tracking_from_s", ".2f"),
    ("times the train was lost", "times_lost", "d"),
    ("share of time without fresh packets", "stale_share", share),
    ("hand's error in lap 2, rms [mm]", "hand_rms_mm_lap_2", ".2f"),
    ("hand's error in the last lap, rms [mm]", "hand_rms_mm_last_lap", ".2f"),
    ("hand's jerk in lap 2, rms [m/s^3]", "hand_jerk_lap_2", ".2f"),
    ("hand's jerk in the last lap, rms [m/s^3]", "hand_jerk_last_lap", ".2f"),
    ("change of the error from lap 2 to the last lap, line fitted to all laps", "hand_rms_mm_change", change),
    ("change of the jerk, likewise", "hand_jerk_change", change),
    ("error of the present position (servo's target), rms [mm]", "target_rms_mm", ".2f"),
    ("the same, 95th percentile [mm]", "target_p95_mm", ".2f"),
    ("the same, along the track, rms [mm]", "target_rms_along_mm", ".2f"),
    ("the same, across the track, rms [mm]", "target_rms_across_mm", ".2f"),
    ("cycles with a valid point", "valid_share", share),
    ("error of the triangulated point, rms [mm]", "point_rms_mm", ".2f"),
    ("its jitter, horizontal [mm]", "point_jitter_mm", ".2f"),
    ("its jitter along the track [mm]", "point_jitter_along_mm", ".2f"),
    ("its jitter across the track [mm]", "point_jitter_across_mm", ".2f"),
    ("its jitter, vertical [mm]", "point_jitter_vertical_mm", ".2f"),
    ("its mean error along the track [mm]", "point_mean_along_mm", "+.2f"),
    ("its mean error across the track [mm]", "point_mean_across_mm", "+.2f"),
    ("its mean error, vertical [mm]", "point_mean_vertical_mm", "+.2f"),
    ("middle image to prediction, least [ms]", "lag_min_ms", ".4f"),
    ("middle image to prediction, greatest [ms]", "lag_max_ms", ".4f"),
    ("predictions timed", "predictions", "d"),
    ("smallest distance to a joint limit [rad]", "joint_limit_margin_rad", ".3f"),
    ("largest fraction of a rated joint speed", "speed_share", share),
    ("longest saturation of a drive [s]", "longest_saturation_s", ".4f"),
    ("table touched", "table_touched", lambda touched: "yes" if touched else "no"),
    ("real-time factor", "real_time_factor", ".2f"),
)
"""Rows of the table: label, key of the result, format."""


def laps_table(results):
    """Returns (header, rows) of the results, a column per direction."""
    lines = [
        [label, *(form(result[key]) if callable(form) else format(result[key], form) for result in results)]
        for label, key, form in ROWS
    ]
    return ["", *(result["direction"] for result in results)], lines


def bias_table(results):
    """Returns (header, rows) of the points' mean error over the train's heading."""
    width = 360 // HEADING_BINS
    lines = [
        [
            f"{k * width}-{(k + 1) * width}",
            *(", ".join(f"{x:+.1f}" for x in result["point_bias_by_heading_mm"][k]) for result in results),
        ]
        for k in range(HEADING_BINS)
    ]
    return ["heading [deg]", *(f"{result['direction']}: along, across, vertical [mm]" for result in results)], lines


def last_against_second(result):
    """Returns the relative change of the hand's error and of its jerk from lap 2 to the last lap."""
    return tuple(result[f"{name}_last_lap"] / result[f"{name}_lap_2"] - 1 for name in ("hand_rms_mm", "hand_jerk"))
