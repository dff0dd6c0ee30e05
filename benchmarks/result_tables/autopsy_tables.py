"""The tables of `autopsy.py`, from its results."""

from typing import NamedTuple

from shared.common import interval


class Shown(NamedTuple):
    """What the table says about a fault: the stage that the autopsy should name, the fault in words, its unit."""

    stage: str | None
    what: str
    unit: str


FAULTS = {
    "vision": Shown("vision", "left camera's centroids shifted by", "px"),
    "triangulation": Shown("triangulation", "right camera's calibration rotated by", "rad"),
    "filter": Shown("filter", "low-pass filter before the estimator, time constant", "s"),
    "prediction": Shown("prediction", "prediction mixed with constant velocity, weight", ""),
    "link": Shown("link", "packets lost, 30 in a row on average, fraction", ""),
    "servo": Shown("servo", "set-points read too early in the packet, by", "s"),
    "timing": Shown("grasp timing", "`grasp.closing_lead`", "s"),
    "none": Shown(None, "no fault, measured vision", ""),
    "none-rendered": Shown(None, "no fault, rendered images", ""),
}
"""The faults by their name in the results; the stage is the autopsy's word for it."""


def failures(rows, name):
    """Returns (runs, failed runs, failed runs of which the autopsy named the right stage) of a fault."""
    runs = [row for row in rows if row["fault"] == name]
    failed = [row for row in runs if not row["success"]]
    return len(runs), len(failed), sum(row["named"] == FAULTS[name].stage for row in failed)


def totals(rows):
    """Returns the sums of `failures` over the seven faults."""
    return tuple(map(sum, zip(*(failures(rows, name) for name, fault in FAULTS.items() if fault.stage))))


def named_wrongly(rows):
    """Returns the failed runs in which the autopsy named another stage than the one at fault."""
    return [row for row in rows if not row["success"] and row["named"] != FAULTS[row["fault"]].stage]


def faults_table(rows):
    """Returns (header, rows): for each fault how many runs failed, and in how many the right stage was named."""
    lines = []
    for name, fault in FAULTS.items():
        runs, failed, named = failures(rows, name)
        if not runs:
            continue
        size = ""
        if fault.stage:
            value = next(row["size"] for row in rows if row["fault"] == name)
            size = f"{value:g} {fault.unit}".strip()
        ends = [named, interval(named, failed)] if fault.stage and failed else ["", ""]
        lines.append([fault.stage or "none", fault.what, size, runs, failed, *ends])
    runs, failed, named = totals(rows)
    lines.append(["all faults", "", "", runs, failed, named, interval(named, failed)])
    return ["stage at fault", "fault", "size", "runs", "failed", "named correctly", "Wilson 95 %"], lines
