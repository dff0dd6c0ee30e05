"""Tracks in image coordinates on drawn clips (`results/footage.json`)."""

import footage_tables as benchmark

from tables.results import part


def footage_accuracy() -> str:
    return part("footage", benchmark.TABLES, "accuracy")
