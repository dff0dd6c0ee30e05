"""Runs under injected faults, and second attempts (`results/faults.jsonl`, `results/second_attempts.jsonl`)."""

from result_tables import fault_tables as benchmark
from result_tables import second_attempt_tables as second

from tables.results import block, lines, of, origin, table


def faults_summary() -> str:
    rows = lines("faults")
    good, safe = (sum(map(judge, rows)) for judge in (benchmark.is_good, benchmark.limits_kept))
    lifted = sum(bool(row["success"]) for row in rows)
    return (
        f"In {of(good, len(rows), ' runs')} the train was lifted, or the arm stayed safe and the summary names the "
        f"right cause; the train was lifted in {lifted}. No limit of the arm was violated in "
        f"{of(safe, len(rows), ' runs')}."
    )


def faults_table() -> str:
    rows = lines("faults")
    return block(table(*benchmark.faults_table(rows)), origin(rows))


def faults_bad() -> str:
    rows = [
        [
            benchmark.FAULTS[row["fault"]].what,
            row["vision"],
            row["seed"],
            benchmark.verdict(row),
            row.get("cause") or "",
            row["failure_reason"] or "",
        ]
        for row in benchmark.bad_runs(lines("faults"))
    ]
    if not rows:
        return "All runs were good."
    what = "This run was" if len(rows) == 1 else "These runs were"
    header = ["fault", "vision", "seed", "what is wrong", "cause named", "reason of the failure"]
    return f"{what} not good:\n\n{table(header, rows)}"


def second_attempts() -> str:
    rows = lines("second_attempts")
    return block(table(*second.second_attempts_table(rows)), origin(rows))
