"""Tables of the results of `eyes_open.py`, for the terminal and for the documentation."""

import statistics

from shared.common import interval, percent


def _median(values, scale, unit):
    """Returns the median of values as a text, empty without any."""
    return f"{scale * statistics.median(values):.{0 if unit == 'mm' else 1}f} {unit}".rstrip() if values else ""


def _grasps(cell):
    """Returns the columns that every table begins with."""
    first = interval(cell["first_attempt"], cell["runs"])
    return [cell["cell"], cell["runs"], cell["first_attempt"], first, cell["lifted"]]


def event_table(cells):
    """Returns (header, rows) of the events around the launch."""
    header = ["event, time from the launch, descent", "runs", "first attempt", "Wilson 95 %", "lifted"]
    header += ["aborted attempts", "median offset along the path", "table touched"]
    return header, [
        [
            *_grasps(cell),
            cell["aborted"],
            _median(cell["along_m"], 1e3, "mm"),
            cell["table_touched"],
        ]
        for cell in cells
    ]


def calm_table(cells):
    """Returns (header, rows) of the runs without an event."""
    header = ["track, descent", "runs", "first attempt", "Wilson 95 %", "lifted", "median time to grasp", "laps"]
    header += ["median offset along the path"]
    return header, [
        [
            *_grasps(cell),
            _median(cell["times_to_grasp_s"], 1.0, "s"),
            _median(cell["laps"], 1.0, ""),
            _median(cell["along_m"], 1e3, "mm"),
        ]
        for cell in cells
    ]


def pass_table(cells):
    """Returns (header, rows) of the open tracks."""
    header = ["track, speed", "runs", "first attempt", "Wilson 95 %", "lifted", "of these, moving"]
    header += ["median time to grasp", "median offset along the path", "why not"]
    return header, [
        [
            *_grasps(cell),
            cell["lifted_moving"],
            _median(cell["times_to_grasp_s"], 1.0, "s"),
            _median(cell["along_m"], 1e3, "mm"),
            "; ".join(f"{count} x {reason}" for reason, count in cell["causes"].items()),
        ]
        for cell in cells
    ]


def _lifted(cell):
    """Returns the columns that the tables of the cameras begin with."""
    return [cell["cell"], cell["runs"], cell["lifted"], interval(cell["lifted"], cell["runs"])]


def _two(values):
    """Returns a median and a 95th percentile in mm, empty without values."""
    return [f"{1e3 * value:.1f} mm" for value in values] if values else ["", ""]


def hand_table(cells):
    """Returns (header, rows) of the wrong calibrations."""
    header = ["hand", "runs", "lifted", "Wilson 95 %", "relative error, median", "95th percentile", "measurements"]
    return header, [[*_lifted(cell), *_two(cell["relative_m"]), cell["measured"]] for cell in cells]


def wrist_table(cells):
    """Returns (header, rows) of the camera on the hand."""
    header = ["scenario", "runs", "lifted", "Wilson 95 %", "error across, median", "95th percentile"]
    header += ["error along, median", "95th percentile", "train measured"]
    return header, [
        [
            *_lifted(cell),
            *_two(cell["errors_across_m"]),
            *_two(cell["errors_along_m"]),
            percent(cell["measured"] / cell["cycles"]) if cell["cycles"] else "",
        ]
        for cell in cells
    ]


TABLES = {
    "event": event_table,
    "calm": calm_table,
    "pass": pass_table,
    "hand": hand_table,
    "wrist": wrist_table,
}
