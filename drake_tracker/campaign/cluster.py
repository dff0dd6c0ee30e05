"""Trials on many machines, through dask.distributed: a running scheduler and its workers.

    dask scheduler                                   on one machine; it prints its address
    dask worker tcp://ADDRESS --nthreads 1           on each machine, one per core (--nworkers N)

Every worker needs this package in the same version, and must find the files that a scenario names at the same path. The
nanny of a worker that dies starts it again, and another worker gets its trial. A trial is lost when it has killed more
workers than the scheduler allows (``distributed.scheduler.allowed-failures``, 3).
"""

import logging
import os
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import Any

from drake_tracker import __version__
from drake_tracker.campaign.plan import Lost
from drake_tracker.campaign.pool import Runner
from drake_tracker.core.errors import DrakeTrackerError, load_extra
from drake_tracker.world.imaging.image_pipeline import VARIABLE

CONNECT_TIMEOUT = 10.0
"""Time [s] within which a scheduler must answer."""
WORKERS_TIMEOUT = 60.0
"""Time [s] for which a campaign waits while there is no worker."""
_POLL_PERIOD = 2.0


def cluster(address: str) -> Runner:
    """Returns a `pool.Runner` on the workers of a scheduler.

    Raises DrakeTrackerError without the extra ``cluster``. When it runs, it raises DrakeTrackerError if the scheduler
    does not answer, is lost or has no workers, or if a worker has another version of this package.

    Args:
        address: of the scheduler, such as tcp://host:8786.
    """
    load_extra("distributed", "cluster", "--scheduler")

    def run(work: Callable[[Any], Any], jobs: Iterable[Any]) -> Generator[tuple[Any, Any], None, None]:
        with _quiet(), _connect(address) as client:
            _await_workers(client, address)
            _check_versions(client)
            yield from _run(client, address, work, iter(jobs))

    return run


def _run(
    client: Any, address: str, work: Callable[[Any], Any], jobs: Iterator[Any]
) -> Generator[tuple[Any, Any], None, None]:
    from distributed import wait

    running: dict[Any, Any] = {}
    without_workers = None
    try:
        while True:
            # No more jobs at a time than threads: a job that waits at a worker that dies would count as its victim.
            threads = sum(client.nthreads().values())
            for job in islice(jobs, max(threads, 1, len(running)) - len(running)):
                running[client.submit(_render_in_process, work, job, pure=False)] = job
            if not running:
                return
            try:
                done = wait(list(running), timeout=_POLL_PERIOD, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                done = ()
            for future in done:
                yield running.pop(future), _result(future)
            now = time.monotonic()
            without_workers = (without_workers or now) if threads == 0 else None
            if without_workers and now - without_workers > WORKERS_TIMEOUT:
                raise DrakeTrackerError(f"--scheduler {address}: no worker is left; start one: dask worker {address}")
    except Exception as error:
        if client.status == "running" and not isinstance(error, (OSError, CancelledError)):
            raise
        raise DrakeTrackerError(f"--scheduler {address}: the scheduler is gone ({type(error).__name__})") from None
    finally:
        if client.status == "running":
            client.cancel(list(running), force=True)


def _render_in_process(work: Callable[[Any], Any], job: Any) -> Any:
    """Does a job on a worker, whose other processors have other jobs."""
    os.environ.setdefault(VARIABLE, "0")
    return work(job)


def _result(future: Any) -> Any:
    if future.status == "finished":
        return future.result()
    if future.status == "error":
        error = future.exception()
        return Lost(f"{type(error).__name__}: {' '.join(str(error).split())}")
    raise ConnectionError(future.status)


@contextmanager
def _connect(address: str) -> Iterator[Any]:
    from distributed import Client

    try:
        client = Client(address, timeout=CONNECT_TIMEOUT)
    except (OSError, ValueError, TypeError) as error:
        reason = f"no scheduler answers there within {CONNECT_TIMEOUT:g} s"
        if isinstance(error, (ValueError, TypeError)):
            reason = f"not an address such as tcp://host:8786 ({error})"
        raise DrakeTrackerError(f"--scheduler {address}: {reason}") from None
    try:
        yield client
    finally:
        client.close(timeout=CONNECT_TIMEOUT)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keeps the log of dask.distributed off the terminal: an error of the campaign is reported in one line."""
    import distributed  # noqa: F401 (loading it creates its loggers)

    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]
    levels = {logger: logger.level for logger in map(logging.getLogger, names)}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


def _await_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKERS_TIMEOUT)
    except TimeoutError:
        raise DrakeTrackerError(
            f"--scheduler {address}: it has had no worker for {WORKERS_TIMEOUT:g} s; start one: dask worker {address}"
        ) from None


def _check_versions(client: Any) -> None:
    for worker, found in client.run(_version, on_error="return").items():
        if found != __version__:
            what = f"cannot load it ({found})" if isinstance(found, Exception) else f"has {found}"
            raise DrakeTrackerError(f"the worker {worker} needs drake_tracker {__version__}, and {what}")


def _version() -> str:
    return __version__
