"""Success of policies against latency, and of a network that imitates (`results/imitation.json`)."""

from result_tables.imitation_tables import imitation_table
from result_tables.latency_curve_tables import latency_table

from tables.results import block, commit_of, data, lines, origin, ranges, table


def latency_curve() -> str:
    rows = lines("latency_curve")
    return block(table(*latency_table(rows)), origin(rows))


def imitation() -> str:
    found = data("imitation")
    made_by = found["made_by"]
    text = f"{found['samples']} samples, {found['training_s']:.0f} s for reading and training."
    return block(
        table(*imitation_table(found)), text, f"*Seeds {ranges(made_by['seeds'])}, commit `{commit_of(made_by)}`.*"
    )
