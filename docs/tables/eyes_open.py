"""Vision until contact (`results/eyes_open.json`, `results/launches.jsonl`)."""

from result_tables import eyes_open_tables as benchmark
from result_tables.launch_tables import calibration_table

from tables.results import block, lines, origin, part, table


def eyes_open_event() -> str:
    return part("eyes_open", benchmark.TABLES, "event")


def eyes_open_calm() -> str:
    return part("eyes_open", benchmark.TABLES, "calm")


def eyes_open_pass() -> str:
    return part("eyes_open", benchmark.TABLES, "pass")


def eyes_open_hand() -> str:
    return part("eyes_open", benchmark.TABLES, "hand")


def eyes_open_wrist() -> str:
    return part("eyes_open", benchmark.TABLES, "wrist")


def launches_calibration() -> str:
    rows = [row for row in lines("launches") if not row["group"].startswith("from ")]
    return block(table(*calibration_table(rows)), origin(rows))
