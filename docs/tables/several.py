"""The vision that tracks several objects (`results/several.json`), one block for each part of the benchmark."""

from result_tables import several_tables as benchmark

from tables.results import part


def several_separation() -> str:
    return part("several", benchmark.TABLES, "separation")


def several_passing() -> str:
    return part("several", benchmark.TABLES, "passing")


def several_coverage() -> str:
    return part("several", benchmark.TABLES, "coverage")


def several_lift() -> str:
    return part("several", benchmark.TABLES, "lift")


def several_cameras() -> str:
    return part("several", benchmark.TABLES, "cameras")


def several_shake() -> str:
    return part("several", benchmark.TABLES, "shake")


def several_cost() -> str:
    return part("several", benchmark.TABLES, "cost")
