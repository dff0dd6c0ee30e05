"""The table of `hard_paths.py`."""

from shared.common import share

NAMES = {"bends": "eight tracks with bends of 28 to 60 mm", "line": "a line, one pass"}
NAMES["hills"] = "an oval with heights of 12 to 90 mm, banked"
NAMES["walks"] = "random walk of a {}, lag of {} cycle{}"
NAMES["known"] = NAMES["walks"] + ", known to the estimator"


def _cell(row):
    """Returns (kind, rendered, scenario, what walks, lag in cycles, speed) of a row."""
    body, _, lag = row["family"].partition(", lag of ") if row["kind"] in ("walks", "known") else ("", "", "0")
    return row["kind"], row["rendered"], row["scenario"], body, int(lag), row["speed"]


def describe(row):
    """Returns the outcome of a run as a text."""
    said = f"{row['scenario']} {row['family']} {row['speed']:g} m/s seed {row['seed']}: "
    return said + (f"lifted at attempt {row['attempts']}" if row["success"] else str(row["failure_reason"]))


def hard_paths_table(rows):
    """Returns (header, rows) of a table with one row for each kind, vision, scenario and speed."""
    lines = []
    order = list(NAMES)
    for cell in sorted({_cell(row) for row in rows}, key=lambda cell: (order.index(cell[0]), *cell[1:])):
        (kind, rendered, scenario, body, lag, speed), runs = cell, [row for row in rows if _cell(row) == cell]
        counts = [sum(bool(row[key]) for row in runs) for key in ("success", "first_attempt_success")]
        vision = "cameras" if rendered else "measured vision"
        shares = [text for count in counts for text in share(count, len(runs))]
        name = NAMES[kind].format(body, lag, "s" * (lag != 1))
        lines.append([name, vision, f"`{scenario}`", f"{speed:g}", len(runs), *shares])
    header = ["track", "vision", "scenario", "speed [m/s]", "runs", "lifted", "Wilson 95 %"]
    return [*header, "at the first attempt", "Wilson 95 %"], lines
