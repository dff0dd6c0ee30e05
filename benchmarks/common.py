"""What the benchmarks share."""

import json
import os
import sys
import time
from pathlib import Path

from drake_tracker.trials import WorkerDied, run_trials


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


def read_lines(path):
    """Returns the results that a file holds, one JSON object a line; none when there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]


def append_results(work, jobs, path, workers, describe):
    """Runs ``work(job)`` for all jobs on so many workers, and appends each result to the file ``path`` as it comes.

    A result is a dict, and one line of the file. ``describe(result)`` is what the line of progress says of it. A job
    whose worker died leaves no line, so that the next call runs it again.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for library in ("LP", "OPENBLAS"):  # each worker on its own core: more threads only get in the way
        os.environ[f"{library}_NUM_THREADS"] = "1"
    start = time.monotonic()
    for count, (job, result) in enumerate(run_trials(work, jobs, workers), 1):
        if isinstance(result, WorkerDied):
            said = f"{job}: its worker died (exit code {result.exit_code}); run it again"
        else:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(result, separators=(",", ":")) + "\n")
            said = describe(result)
        left = (time.monotonic() - start) / count * (len(jobs) - count)
        print(f"[{count}/{len(jobs)}, {left / 60:.0f} min left] {said}", file=sys.stderr, flush=True)
