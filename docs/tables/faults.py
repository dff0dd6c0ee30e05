"""Runs under injected faults, and second attempts (`results/faults.jsonl`, `results/second_attempts.jsonl`)."""

from result_tables import fault_tables as benchmark
from result_tables import second_attempt_tables as second

from tables.results import block, lines, of, origin, table, uses


def faults_summary() -> str:
    rows = lines("faults")
    parts = []
    for scenario in sorted(set(map(benchmark.scenario_of, rows)), key=benchmark.RUNGS.index):
        own = [row for row in rows if benchmark.scenario_of(row) == scenario]
        good, safe = (sum(map(judge, own)) for judge in (benchmark.is_good, benchmark.limits_kept))
        lifted = sum(bool(row["success"]) for row in own)
        parts.append(
            f"`{scenario}`: in {of(good, len(own), ' runs')} the train was lifted, or the arm stayed safe and the "
            f"summary names the right cause; the train was lifted in {lifted}. No limit of the arm was violated in "
            f"{of(safe, len(own), ' runs')}."
        )
    return block(*parts)


def faults_table() -> str:
    rows = [row for row in lines("faults") if " + " not in row["fault"]]
    return block(table(*benchmark.faults_table(rows)), origin(rows))


def faults_pairs() -> str:
    rows = [row for row in lines("faults") if " + " in row["fault"]]
    failed = [row for row in rows if not row["success"] and benchmark.both_acted(row)]
    named = of(sum(map(benchmark.both_named, failed)), len(failed), " runs")
    text = (
        f"Of the runs without a lift in which both faults could show ({benchmark.SHOWN:.0f} s after the second began; "
        f"with a fault of the gripper, after an attempt), the summary names a right cause for both in {named}."
    )
    return block(table(*benchmark.faults_table(rows)), origin(rows), text)


def faults_bad() -> str:
    bad = benchmark.bad_runs(lines("faults"))
    uses(*bad)
    rows = [
        [
            f"`{benchmark.scenario_of(row)}`",
            " + ".join(benchmark.FAULTS[each].what for each in row["fault"].split(" + ")),
            row["vision"],
            row["seed"],
            benchmark.verdict(row),
            row.get("cause") or "",
            row["failure_reason"] or "",
        ]
        for row in bad
    ]
    if not rows:
        return "All runs were good."
    what = "This run was" if len(rows) == 1 else "These runs were"
    header = ["scenario", "fault", "vision", "seed", "what is wrong", "cause named", "reason of the failure"]
    return f"{what} not good:\n\n{table(header, rows)}"


def second_attempts() -> str:
    rows = lines("second_attempts")
    return block(table(*second.second_attempts_table(rows)), origin(rows))
