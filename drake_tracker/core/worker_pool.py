"""Many independent trials on all cores: each in a process of its own making, none the worse when another one dies."""

import multiprocessing
import signal
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from typing import Any, NamedTuple

FRESH_AFTER = 20
"""Trials after which a worker makes way for a new process: what native code leaks goes with it."""


class WorkerDied(NamedTuple):
    """In the place of a result: the process ended before it had one. ``exit_code`` below 0 is a signal's number."""

    exit_code: int


@dataclass
class _Worker:
    process: Any
    pipe: Any
    job: Any = None
    trials: int = field(default=0)


def run_trials(work, jobs, workers):
    """Yields (job, result) of ``work(job)`` for every job, in the order in which they end.

    Args:
      work: a function of a module, called in spawned processes. jobs: an iterable of picklable things; the next one is
      taken when a worker is free. workers: how many processes work at a time.

    A worker that dies, whatever killed it, yields (job, `WorkerDied`) for its own job; another takes its place. When
    the caller stops early (or on Ctrl-C) the processes are ended.
    """
    context = multiprocessing.get_context("spawn")
    jobs = iter(jobs)
    busy = {}
    try:
        for _ in range(workers):
            _give_next(context, work, jobs, None, busy)
        while busy:
            for pipe in wait(list(busy)):
                worker = busy.pop(pipe)
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
        for worker in busy.values():
            worker.process.terminate()


def _give_next(context, work, jobs, worker, busy):
    """Gives the next job to a worker, or to a new one for None or a tired one; ends the worker when there is none."""
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


def _serve(work, pipe):
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the caller's to answer
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
