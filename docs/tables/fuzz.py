"""Damaged input (`results/fuzz.json`)."""

from result_tables import fuzz_table as benchmark
from shared.common import RESULTS

from tables.results import block, commit_of, data, table


def fuzzing() -> str:
    if not (RESULTS / "fuzz.json").exists():
        return "There are no results of this commit yet."
    found = data("fuzz")
    made_by = found["made_by"]
    text = f"*Seed {made_by['seeds'][0]}, commit `{commit_of(made_by)}`, {found['minutes']:g} minutes.*"
    return block(table(*benchmark.table(found)), text)
