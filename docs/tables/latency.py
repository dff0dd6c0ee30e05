"""The latency of cameras on synthetic photographs (`results/latency.json`)."""

from result_tables import latency_tables as benchmark

from tables.results import part


def latency_accuracy() -> str:
    return part("latency", benchmark.TABLES, "accuracy")
