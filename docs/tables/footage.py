"""Tracks in image coordinates on drawn clips, and of files (`results/footage.json`)."""

from result_tables import footage_tables as benchmark

from tables.results import part


def footage_accuracy() -> str:
    return part("footage", benchmark.TABLES, "accuracy")


def footage_files() -> str:
    return part("footage", benchmark.TABLES, "files")


def footage_person() -> str:
    return part("footage", benchmark.TABLES, "person")


def footage_photographs() -> str:
    return part("footage", benchmark.TABLES, "photographs")


def footage_fast() -> str:
    return part("footage", benchmark.TABLES, "fast")


def footage_hidden() -> str:
    return part("footage", benchmark.TABLES, "hidden")


def footage_several() -> str:
    return part("footage", benchmark.TABLES, "several")


def footage_speed() -> str:
    return part("footage", benchmark.TABLES, "speed")
