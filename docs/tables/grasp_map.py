"""Lifted trains over lag and speed (`results/grasp_map.jsonl`)."""

import grasp_map as benchmark

from tables.results import block, lines, listed, of, origin, table, where


def grasp_map_arc_length() -> str:
    return _map("arc_length")


def grasp_map_closed_path() -> str:
    return _map("closed_path")


def grasp_map_cameras() -> str:
    rows = lines("grasp_map")
    return block(table(*benchmark.cameras_table(rows, list(benchmark.MAPPED))), origin(where(rows, vision="Rendered")))


def grasp_map_last_moment() -> str:
    rows = where(lines("grasp_map"), vision="Measured", estimator="closed_path")
    held = [
        row for row in rows
        if not row["success"] and 0.35 < row["speed"] < 0.55 and "held the train" in (row["failure_reason"] or "")
    ]  # fmt: skip
    missed = [row for row in rows if not row["success"] and 0.35 < row["speed"] < 0.55]
    speeds = listed([f"{speed:g}" for speed in sorted({row["speed"] for row in missed})])
    return (
        f"With the closed path, {len(missed)} runs at {speeds} m/s count as failures; in {len(held)} of them the hand "
        "held the train when the time was up."
    )


def _map(estimator: str) -> str:
    rows = where(lines("grasp_map"), vision="Measured", estimator=estimator)
    total = of(sum(bool(row["success"]) for row in rows), len(rows))
    per_cell = {len(where(rows, lag_cycles=lag, speed=speed)) for lag in benchmark.LAGS for speed in benchmark.SPEEDS}
    cells = f"{listed([str(count) for count in sorted(per_cell)])} runs per cell."
    return block(table(*benchmark.map_table(rows, estimator)), origin(rows, cells, f"In all: {total}."))
