"""A pool of worker processes for independent trials, each started afresh.

The standard library's pools do not fit: a worker that is killed by a signal breaks a `ProcessPoolExecutor` for all
trials, and hangs a `multiprocessing.Pool`. Here it costs only its own trial.
"""

import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from typing import Any, NamedTuple

FRESH_AFTER = 20
"""Trials after which a worker is replaced by a new process, so that memory leaked by native code is released."""


class WorkerDied(NamedTuple):
    """Takes the place of a result when the process ended before it had one.

    Attributes:
        exit_code: exit code of the process; below 0 it is the number of a signal.
    """

    exit_code: int


@dataclass
class _Worker:
    process: Any
    pipe: Any
    job: Any = None
    trials: int = field(default=0)


def run_trials(work: Callable[[Any], Any], jobs: Iterable[Any], workers: int) -> Iterator[tuple[Any, Any]]:
    """Yields (job, result) of ``work(job)`` for every job, in the order in which they end.

    A worker that dies, whatever the cause, yields (job, `WorkerDied`) for its own job, and another takes its place.
    When the caller stops early (or on Ctrl-C) the processes are ended.

    Args:
        work: a function of a module, called in spawned processes.
        jobs: picklable objects; the next one is taken when a worker is free.
        workers: number of processes that work at the same time.
    """
    context = multiprocessing.get_context("spawn")
    jobs = iter(jobs)
    busy: dict[Any, _Worker] = {}
    try:
        for _ in range(workers):
            _give_next(context, work, jobs, None, busy)
        while busy:
            pipe: Any
            for pipe in wait(list(busy)):
                worker: _Worker | None = busy.pop(pipe)
                assert worker
                job = worker.job
                try:
                    result = pipe.recv()
                except (EOFError, ConnectionError):  # the latter when it died before it read its job
                    worker.process.join()
                    result = WorkerDied(worker.process.exitcode)
                    worker = None
                _give_next(context, work, jobs, worker, busy)
                yield job, result
    finally:
        for left in busy.values():
            left.process.terminate()


def _give_next(
    context: Any, work: Callable[[Any], Any], jobs: Iterator[Any], worker: _Worker | None, busy: dict[Any, _Worker]
) -> None:
    """Gives the next job to a worker. A new one replaces None or one that has done its share; without jobs it ends."""
    job = next(jobs, _NO_JOB)
    if worker is not None and (job is _NO_JOB or worker.trials >= FRESH_AFTER):
        worker.pipe.close()
        worker.process.join()
        worker = None
    if job is _NO_JOB:
        return
    if worker is None:
        pipe, far_end = context.Pipe()
        process = context.Process(target=_serve, args=(work, far_end), daemon=True)
        process.start()
        far_end.close()
        worker = _Worker(process, pipe)
    worker.job, worker.trials = job, worker.trials + 1
    worker.pipe.send(job)
    busy[worker.pipe] = worker


_NO_JOB = object()


def _serve(work: Callable[[Any], Any], pipe: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller handles Ctrl-C
    while True:
        try:
            job = pipe.recv()
        except EOFError:
            return
        result = work(job)
        try:
            pipe.send(result)
        except BrokenPipeError:  # the caller was killed
            return
