"""Success of policies against latency (`results/latency_curve.jsonl`)."""

from result_tables.latency_curve_tables import latency_table

from tables.results import block, lines, origin, table


def latency_curve() -> str:
    rows = lines("latency_curve")
    return block(table(*latency_table(rows)), origin(rows))
