"""What terminated commands leave behind (`results/terminations.jsonl`)."""

import terminations as benchmark

from tables.results import block, commits, lines, of, origin, table


def records_terminations() -> str:
    rows = lines("terminations")
    return block(table(*benchmark.table(rows)), origin(rows))


def records_summary() -> str:
    rows = lines("terminations")
    good = sum(not row["problems"] for row in rows)
    left = sum(bool(row["files"]) for row in rows)
    return (
        f"After {of(good, len(rows), ' terminations')} every file that was left could be read and the exit code was "
        f"the documented one ({commits(rows)}). {left} of them left files; the others came before there was anything "
        "to record."
    )
