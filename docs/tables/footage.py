"""Tracks in image coordinates on drawn clips, and of files (`results/footage.json`)."""

import footage_tables as benchmark

from tables.results import part


def footage_accuracy() -> str:
    return part("footage", benchmark.TABLES, "accuracy")


def footage_files() -> str:
    return part("footage", benchmark.TABLES, "files")


def footage_person() -> str:
    return part("footage", benchmark.TABLES, "person")


def footage_speed() -> str:
    return part("footage", benchmark.TABLES, "speed")
