"""A pool of spawned worker processes for independent trials.

The pools of the standard library do not survive the death of a worker: a worker killed by a signal makes a
`ProcessPoolExecutor` lose all trials and a `multiprocessing.Pool` hang. Here only the worker's own trial is lost.
"""

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from typing import Any, NamedTuple

_PR_SET_PDEATHSIG = 1
"""Request to Linux, which Python does not name: a signal at the end of the thread that started this process."""
_WATCH_PERIOD = 0.5
"""Time between two looks at the parent process [s]."""
FRESH_AFTER = 20
"""Number of trials after which a worker is replaced by a new process, to release memory leaked by native code."""


class WorkerDied(NamedTuple):
    """Replaces the result of a trial whose process ended before it returned one.

    Attributes:
        exit_code: exit code of the process; a negative one is the number of a signal.
    """

    exit_code: int


@dataclass
class _Worker:
    process: Any
    pipe: Any
    job: Any = None
    trials: int = field(default=0)


def run_trials(work: Callable[[Any], Any], jobs: Iterable[Any], workers: int) -> Iterator[tuple[Any, Any]]:
    """Yields (job, result of ``work(job)``) for every job, in the order in which the trials end.

    When a worker dies, whatever the cause, (job, `WorkerDied`) is yielded for its job and a new worker replaces it. The
    processes are terminated when the caller stops early, also by Ctrl-C, and end when the caller is killed.

    Args:
        work: a function defined at the top of a module, called in spawned processes.
        jobs: picklable objects; the next one is drawn when a worker becomes free.
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
                except (EOFError, ConnectionError):  # a ConnectionError: it died before it read its job
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
    """Gives the next job to a worker: a new one if ``worker`` is None or has done `FRESH_AFTER` trials. Without a job
    left, the worker is ended.
    """
    job = next(jobs, _NO_JOB)
    if worker is not None and (job is _NO_JOB or worker.trials >= FRESH_AFTER):
        worker.pipe.close()
        worker.process.join()
        worker = None
    if job is _NO_JOB:
        return
    if worker is None:
        pipe, far_end = context.Pipe()
        process = context.Process(target=_serve, args=(work, far_end, os.getpid()), daemon=True)
        process.start()
        far_end.close()
        worker = _Worker(process, pipe)
    worker.job, worker.trials = job, worker.trials + 1
    worker.pipe.send(job)
    busy[worker.pipe] = worker


_NO_JOB = object()


def _end_with(parent: int) -> None:
    """Lets this process end at once when its parent process has ended, also in the middle of a trial."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)

    def watch() -> None:  # on other systems, and for a parent that had ended before
        while os.getppid() == parent:
            time.sleep(_WATCH_PERIOD)
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()


def _serve(work: Callable[[Any], Any], pipe: Any, parent: int) -> None:
    _end_with(parent)
    for request in (signal.SIGINT, signal.SIGHUP):  # the caller handles Ctrl-C and the end of the terminal
        signal.signal(request, signal.SIG_IGN)
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


def processors() -> int:
    """Returns the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
