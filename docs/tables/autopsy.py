"""Faults that the autopsy of a failed run names (`results/autopsy.jsonl`)."""

from result_tables import autopsy_tables as benchmark

from tables.results import block, lines, of, origin, table


def autopsy_faults() -> str:
    rows = lines("autopsy")
    return block(table(*benchmark.faults_table(rows)), origin(rows))


def autopsy_summary() -> str:
    rows = lines("autopsy")
    runs, failed, named = benchmark.totals(rows)
    controls = [row for row in rows if not benchmark.FAULTS[row["fault"]].stage]
    lifted = sum(bool(row["success"]) for row in controls)
    return (
        f"Of {runs} runs with a fault, {failed} failed; the autopsy named the right stage in {of(named, failed)}. "
        f"Without a fault, {lifted} of {len(controls)} trains were lifted."
    )


def autopsy_wrong() -> str:
    rows = [
        [row["fault"], row["seed"], row["named"], row["failure_reason"]]
        for row in benchmark.named_wrongly(lines("autopsy"))
    ]
    return table(["fault", "seed", "named", "reason of the failure"], rows)
