"""What the benchmarks share."""

import json
import sys
import time
from pathlib import Path

from drake_tracker.campaign.pool import pool
from drake_tracker.campaign.record import Record
from drake_tracker.campaign.trial import Lost
from drake_tracker.core.progress import time_left


def print_table(header, rows):
    """Prints rows of texts and numbers as a Markdown table."""
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print(flush=True)


def save_json(results, path):
    """Writes results as JSON when a path is given."""
    if path is not None:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")


def append_results(work, jobs, path, workers, describe):
    """Runs ``work(job)`` for all jobs on so many workers, and appends each result to the file ``path`` as it comes.

    A result is a dict, and one line of the file. ``describe(result)`` is what the line of progress says of it. A job
    whose worker died, or could not run it, leaves no line, so that the next call runs it again.
    """
    start = time.monotonic()
    with Record(path) as record:
        for count, (job, result) in enumerate(pool(workers)(work, jobs), 1):
            if isinstance(result, Lost):
                said = f"{job}: {result.reason}; run it again"
            else:
                record.append(result)
                said = describe(result)
            left = time_left(time.monotonic() - start, count, len(jobs) - count)
            print(f"[{count}/{len(jobs)}, {left} left] {said}", file=sys.stderr, flush=True)
