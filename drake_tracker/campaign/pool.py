"""Trials on the cores of this machine."""

import os
from collections.abc import Callable, Generator, Iterable
from typing import Any

from drake_tracker.campaign.trial import Lost
from drake_tracker.core.worker_pool import WorkerDied, run_trials

Runner = Callable[[Callable[[Any], Any], Iterable[Any]], Generator[tuple[Any, Any], None, None]]
"""A function ``run(work, jobs)`` that yields (job, result of ``work(job)`` or `Lost`) for every job, in the order in
which the jobs end. It takes the next job when a worker is free, and stops its workers when it is closed."""


def pool(workers: int) -> Runner:
    """Returns a `Runner` on processes of this machine.

    It uses `core.worker_pool` and not `concurrent.futures`: there, a worker that a signal kills (a crash of native
    code, a lack of memory) breaks the whole pool; here it costs only its own trial.

    Args:
        workers: number of processes.
    """

    def run(work: Callable[[Any], Any], jobs: Iterable[Any]) -> Generator[tuple[Any, Any], None, None]:
        for library in ("LP", "OPENBLAS"):  # each worker has a core of its own, and more threads slow it down
            os.environ[f"{library}_NUM_THREADS"] = "1"
        for job, result in run_trials(work, jobs, workers):
            if isinstance(result, WorkerDied):
                result = Lost(f"its worker died (exit code {result.exit_code})")
            yield job, result

    return run
