"""The conveyor (`results/conveyor.json`), one block for each part of the benchmark."""

import conveyor_vision as vision
from result_tables import conveyor_tables as benchmark

from tables.results import part


def conveyor_capacity() -> str:
    return part("conveyor", benchmark.TABLES, "capacity")


def conveyor_load() -> str:
    return part("conveyor", benchmark.TABLES, "load")


def conveyor_saturated() -> str:
    return part("conveyor", benchmark.TABLES, "saturated")


def conveyor_map() -> str:
    return part("conveyor", benchmark.TABLES, "map")


def conveyor_stop() -> str:
    return part("conveyor", benchmark.TABLES, "stop")


def conveyor_incline() -> str:
    return part("conveyor", benchmark.TABLES, "incline")


def conveyor_speed() -> str:
    return part("conveyor", benchmark.TABLES, "speed")


def conveyor_vision() -> str:
    return part("conveyor_vision", vision.TABLES, "vision")
