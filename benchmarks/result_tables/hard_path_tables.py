"""The table of `hard_paths.py`."""

from shared.common import share

NAMES = {"bends": "eight tracks with bends of 28 to 60 mm", "line": "a line, one pass"}


def describe(row):
    """Returns the outcome of a run as a text."""
    said = f"{row['scenario']} {row['family']} {row['speed']:g} m/s seed {row['seed']}: "
    return said + (f"lifted at attempt {row['attempts']}" if row["success"] else str(row["failure_reason"]))


def hard_paths_table(rows):
    """Returns (header, rows) of a table with one row for each kind, vision, scenario and speed."""
    cells = sorted({(row["kind"], row["rendered"], row["scenario"], row["speed"]) for row in rows})
    lines = []
    for kind, rendered, scenario, speed in cells:
        found = (kind, rendered, scenario, speed)
        runs = [row for row in rows if (row["kind"], row["rendered"], row["scenario"], row["speed"]) == found]
        counts = [sum(bool(row[key]) for row in runs) for key in ("success", "first_attempt_success")]
        vision = "cameras" if rendered else "measured vision"
        shares = [text for count in counts for text in share(count, len(runs))]
        lines.append([NAMES[kind], vision, f"`{scenario}`", f"{speed:.2f}", len(runs), *shares])
    header = ["track", "vision", "scenario", "speed [m/s]", "runs", "lifted", "Wilson 95 %"]
    return [*header, "at the first attempt", "Wilson 95 %"], lines
