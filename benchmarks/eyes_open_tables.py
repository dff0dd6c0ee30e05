"""Tables of the results of `eyes_open.py`, for the terminal and for the documentation."""

import statistics

from common import interval


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
    header += ["median offset along the path", "table touched"]
    return header, [
        [
            *_grasps(cell),
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


TABLES = {"event": event_table, "calm": calm_table}
