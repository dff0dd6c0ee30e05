"""Predicted and computed success (`results/success_law.jsonl`, `results/launches.jsonl`)."""

from result_tables.launch_tables import GROUP_NAMES, calibration_table, cameras_table, threshold_table
from result_tables.law_tables import TOLERANCE, law_table, within

from tables.results import block, lines, origin, table, where


def law_cells() -> str:
    rows = where(lines("success_law"), part="cells")
    right, largest, cells = within(rows)
    text = (
        f"{right} of {cells} cells are within {100 * TOLERANCE:.0f} points of the prediction, all within "
        f"{100 * largest:.0f}."
    )
    return block(table(*law_table(rows)), text, origin(rows))


def launches_calibration() -> str:
    rows = where(lines("launches"), group=GROUP_NAMES.__contains__)
    return block(table(*calibration_table(rows)), origin(rows))


def launches_cameras() -> str:
    rows = where(lines("launches"), group=lambda name: name.endswith("with cameras"))
    return block(table(*cameras_table(rows)), origin(rows))


def launches_thresholds() -> str:
    rows = where(lines("launches"), group=lambda name: name.startswith("from "))
    return block(table(*threshold_table(rows)), origin(rows))
