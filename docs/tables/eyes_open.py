"""Vision until contact (`results/eyes_open.json`)."""

from result_tables import eyes_open_tables as benchmark

from tables.results import part


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
