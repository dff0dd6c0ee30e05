"""The vision that tracks several objects (`results/several.json`), one block for each part of the benchmark."""

import several_tables as benchmark
from common import RESULTS

from tables.results import block, data, ranges, table


def several_separation() -> str:
    return _part("separation")


def several_passing() -> str:
    return _part("passing")


def several_coverage() -> str:
    return _part("coverage")


def several_lift() -> str:
    return _part("lift")


def several_cameras() -> str:
    return _part("cameras")


def several_shake() -> str:
    return _part("shake")


def several_cost() -> str:
    return _part("cost")


def _part(name: str) -> str:
    """Returns the table of a part, or that it was not measured."""
    results = data("several") if (RESULTS / "several.json").exists() else []
    found = next((each for each in results if each["part"] == name), None)
    if found is None:
        return "*Not measured yet.*"
    made_by = found["made_by"]
    origin = f"*Seeds {ranges(made_by['seeds'])}, commit `{made_by['commit'][:7]}`.*"
    return block(table(*benchmark.TABLES[name](found["cells"])), origin)
