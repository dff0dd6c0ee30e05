"""Lifted cubes on the motions of other people's benchmarks (`results/rivals.jsonl`)."""

from result_tables.rival_tables import rivals_table

from tables.results import block, lines, origin, table


def rivals() -> str:
    rows = lines("rivals")
    return block(table(*rivals_table(rows)), origin(rows))
