"""Substitutes for the trials of a campaign: fast, with a known outcome."""

import os
import signal
import time

from drake_tracker.campaign.plan import Lost


def line(trial, **more):
    """A line of the record: every seed lifts a slow train, only odd seeds a fast one."""
    seed = trial.scenario.seed
    speed = getattr(getattr(trial.scenario, "track", None), "speed", 0.0)
    success = speed < 0.25 or seed % 2 == 1
    reason = None if success else "attempt 1 missed"
    return {"settings": trial.settings, "seed": seed, "success": success, "failure_reason": reason, **more}


def quick(trial):
    return line(trial, lag_s={"min": 0.25, "max": 0.26}, error=[1.0, 2], attempts=1)


def lose_seed_1(trial):
    return Lost("MachineError: no renderer") if trial.scenario.seed == 1 else line(trial)


def die_of_seed_1(trial):
    """Kills its process after a second: a nanny does not restart a worker that dies while it is starting."""
    if trial.scenario.seed == 1:
        time.sleep(1.0)
        os.kill(os.getpid(), signal.SIGKILL)
    return line(trial)


def slow(trial):
    time.sleep(0.3)
    return line(trial, process=os.getpid())


def here(work, jobs):
    """A runner in this process."""
    for job in jobs:
        yield job, work(job)


class Stops:
    """A runner in this process that raises ``error`` instead of its result number ``after``."""

    def __init__(self, after, error=KeyboardInterrupt):
        self.after, self.error, self.run = after, error, []

    def __call__(self, work, jobs):
        for count, job in enumerate(jobs):
            if count == self.after:
                raise self.error
            self.run.append(job.key)
            yield job, work(job)
