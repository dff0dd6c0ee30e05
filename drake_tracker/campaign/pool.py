"""Trials on the cores of this machine."""

import os

from drake_tracker.campaign.trial import Lost
from drake_tracker.core.worker_pool import WorkerDied, run_trials


def pool(workers):
    """Returns a runner on ``workers`` processes of this machine.

    A runner is a function ``run(work, jobs)`` that yields (job, result of ``work(job)`` or `Lost`) for every job, in
    the order in which they end, takes jobs only as workers are free, and ends its workers when it is closed.
    """

    def run(work, jobs):
        for library in ("LP", "OPENBLAS"):  # each worker on its own core: more threads only get in the way
            os.environ[f"{library}_NUM_THREADS"] = "1"
        for job, result in run_trials(work, jobs, workers):
            if isinstance(result, WorkerDied):
                result = Lost(f"its worker died (exit code {result.exit_code})")
            yield job, result

    return run
