"""Tables of the results of `eyes_open.py`, for the terminal and for the documentation."""

import statistics

import numpy as np
from common import interval

TENTHS = 10
"""Number of groups of the launches."""


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


def calibrated_table(cells):
    """Returns (header, rows) of the probability of success in tenths of all launches, ordered by it."""
    launches = np.array(sorted(launch for cell in cells for launch in cell["launches"]))
    header = ["launches", "computed probability", "mean", "lifted at this attempt", "share", "Wilson 95 %"]
    rows = []
    for tenth in np.array_split(launches, min(TENTHS, len(launches))):
        probabilities, lifted = tenth[:, 0], int(tenth[:, 1].sum())
        rows.append(
            [
                len(tenth),
                f"{probabilities.min():.3f} to {probabilities.max():.3f}",
                f"{probabilities.mean():.1%}",
                lifted,
                f"{lifted / len(tenth):.1%}",
                interval(lifted, len(tenth)),
            ]
        )
    return header, rows


TABLES = {"event": event_table, "calm": calm_table, "pass": pass_table, "calibrated": calibrated_table}
