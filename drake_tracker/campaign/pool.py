"""Trials on the cores of this machine."""

import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from drake_tracker.campaign.plan import Lost
from drake_tracker.core.processes.worker_pool import WorkerDied, processors, run_trials
from drake_tracker.world.imaging.image_pipeline import VARIABLE

Runner = Callable[[Callable[[Any], Any], Iterable[Any]], Generator[tuple[Any, Any], None, None]]
"""A function ``run(work, jobs)`` that yields (job, result of ``work(job)`` or `Lost`) for every job, in the order in
which the jobs end. It takes the next job when a worker is free, and stops its workers when it is closed."""


def pool(workers: int) -> Runner:
    """Returns a `Runner` on processes of this machine.

    It uses `core.processes.worker_pool` and not `concurrent.futures`: there, a worker that a signal kills (a crash of
    native code, a lack of memory) breaks the whole pool; here it costs only its own trial.
    """

    def run(work: Callable[[Any], Any], jobs: Iterable[Any]) -> Generator[tuple[Any, Any], None, None]:
        # Each worker has a core of its own, and more threads slow it down.
        variables = dict.fromkeys(("LP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"), "1")
        if not has_spare_processors(workers):
            variables[VARIABLE] = os.environ.get(VARIABLE, "0")
        with _environment(variables):
            for job, result in run_trials(work, jobs, workers):
                if isinstance(result, WorkerDied):
                    result = Lost(f"its worker died (exit code {result.exit_code})")
                yield job, result

    return run


def workers_or_all(workers: int | None) -> int:
    """Returns a number of workers; None: one for each core of this machine."""
    return workers or processors()


def has_spare_processors(workers: int) -> bool:
    """Returns whether each worker can have a second processor, for images that are rendered beside the simulation.

    If not, the trials render in their own processes, which is faster: the whole work is less.
    """
    return processors() >= 2 * workers


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Sets environment variables for the processes that are started meanwhile."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
