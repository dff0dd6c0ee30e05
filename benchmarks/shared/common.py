"""What the benchmarks share: tables, intervals, result files, and what every result says about its origin."""

import datetime
import json
import math
import os
import sys
import time
from pathlib import Path

from shared.behaviour_rows import behaviour_of
from shared.stored import RESULTS as RESULTS
from shared.stored import record

from drake_tracker.campaign.plan import Lost
from drake_tracker.campaign.pool import pool
from drake_tracker.campaign.rates import wilson
from drake_tracker.core.progress import time_left
from drake_tracker.tasks.results import git_commit, package_versions

FEWEST = 20
"""Number of runs from which on a count is published as a rate."""
COUNTING = False
"""Whether the command is only asked how many runs it would make."""
_STARTED = time.monotonic()


def markdown_table(header, rows):
    """Returns rows of texts and numbers as a Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines)


def print_table(header, rows):
    """Prints rows of texts and numbers as a Markdown table."""
    print(markdown_table(header, rows))
    print(flush=True)


def percent(part):
    """Returns a part of 1 as a percentage, or an empty text for None and NaN.

    It has no decimals, except between 0 and 0.5 % and between 99.5 and 100 %: 239 of 240 is "99.6 %", not "100 %".
    """
    if part is None or not math.isfinite(part):
        return ""
    decimals = 0
    while 0.0 < part < 1.0 and float(f"{100 * part:.{decimals}f}") in (0.0, 100.0):
        decimals += 1
    return f"{100 * part:.{decimals}f} %"


def share(count, total):
    """Returns a count with its percentage, and its Wilson 95 % interval, as two texts; of fewer than `FEWEST` runs
    without a percentage."""
    if not total:
        return "", ""
    return (f"{count} ({percent(count / total)})" if total >= FEWEST else str(count)), interval(count, total)


def interval(count, total):
    """Returns the Wilson 95 % interval of a rate as a text; for fewer than `FEWEST` runs, that there is no rate."""
    if total < FEWEST:
        return f"under {FEWEST} runs"
    low, high = wilson(count, total)
    return f"{100 * low:.0f}-{100 * high:.0f} %"


def rms(values):
    """Returns the root mean square of a list of numbers, NaN when it is empty."""
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def provenance(seeds, result=None):
    """Returns what a result says about its origin: commit, seeds, package versions, behaviour, command, how long it
    took, and time (UTC).

    Args:
        seeds: the seeds that it rests on.
        result: the result, for a benchmark whose parts rest on different scenarios.
    """
    return {
        **behaviour_of(Path(sys.argv[0]).stem, result or {}),
        "commit": git_commit(),
        "seeds": list(seeds),
        "versions": package_versions(),
        "command": " ".join([*_variables(), "python", f"benchmarks/{Path(sys.argv[0]).name}", *sys.argv[1:]]),
        "wall_s": round(time.monotonic() - _STARTED, 1),
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


def _variables():
    """Returns the environment variables of the command that change its times, as texts."""
    names = ("OPENBLAS_NUM_THREADS", "LP_NUM_THREADS")
    return [f"{name}={os.environ[name]}" for name in names if name in os.environ]


def save_json(results, path, seeds):
    """Writes results as JSON when a path is given; `provenance` is added to them under ``made_by``.

    Args:
        results: a dict, or a list of dicts, each of which gets the origin.
        path: the file, or None.
        seeds: the seeds that the results rest on.
    """
    if path is None:
        return
    if isinstance(results, list):
        results = [{"made_by": provenance(seeds, result), **result} for result in results]
    else:
        results = {"made_by": provenance(seeds, results), **results}
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")


class Counted(Exception):
    """Answer of a command that is only asked how many runs it would make: the number."""


def about_to_run(jobs):
    """Is called before the runs of a command; raises `Counted` if it is only asked for their number."""
    if COUNTING:
        raise Counted(len(jobs))


def append_results(work, jobs, path, workers, describe):
    """Runs ``work(job)`` for all jobs and appends each result to a file as soon as it is there.

    A job whose worker died, or could not run it, leaves no line, so that the next call runs it again. A result that
    does not name its commit (a run that raised an exception) gets commit and versions here. Each line gets the numbers
    of the behaviour that it rests on.

    Args:
        work: a function of a job that returns a dict (one line of the file), or `Lost`.
        jobs: a list of picklable jobs.
        path: the JSONL file.
        workers: the number of processes.
        describe: a function of a result that returns the text of the progress line.
    """
    about_to_run(jobs)
    start = time.monotonic()
    with record(path) as opened:
        for count, (job, result) in enumerate(pool(workers)(work, jobs), 1):
            if isinstance(result, Lost):
                said = f"{job}: {result.reason}; run it again"
            else:
                if not (result.get("git_commit") or result.get("commit")):
                    result = {**result, "package_versions": package_versions(), "git_commit": git_commit()}
                result = {**result, **behaviour_of(Path(sys.argv[0]).stem, result)}
                opened.append(result)
                said = describe(result)
            left = time_left(time.monotonic() - start, count, len(jobs) - count)
            print(f"[{count}/{len(jobs)}, {left} left] {said}", file=sys.stderr, flush=True)
