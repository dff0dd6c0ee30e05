"""Tests of trials in worker processes: all are run, and a trial that kills its worker is the only one lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drake_tracker.core.processes.worker_pool import FRESH_AFTER, WorkerDied, run_trials


def square(number):
    return number * number, os.getpid()


def die_of_seven(number):
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def raise_at_one(number):
    if number == 1:
        raise ValueError("one")
    return number


def test_every_job_is_done_once_and_by_more_than_one_process():
    jobs = range(2 * FRESH_AFTER + 4)
    results = dict(run_trials(square, jobs, 2))
    assert {job: result for job, (result, _) in results.items()} == {job: job * job for job in jobs}
    # Two processes at a time, each replaced after FRESH_AFTER trials.
    assert len({process for _, process in results.values()}) >= 3


def test_only_the_trial_of_a_dead_worker_is_lost():
    results = dict(run_trials(die_of_seven, range(12), 2))
    assert results.pop(7) == WorkerDied(-signal.SIGKILL)
    assert results == {number: number for number in range(12) if number != 7}


class DeadlyToLoad:
    """Work that ends the process that unpickles it, before it has read a job."""

    def __reduce__(self):
        return os._exit, (3,)


def test_only_one_job_is_lost_when_a_worker_dies_before_it_reads_the_job():
    assert dict(run_trials(DeadlyToLoad(), range(2), 1)) == {0: WorkerDied(3), 1: WorkerDied(3)}


def test_an_exception_counts_as_a_death(capfd):
    results = dict(run_trials(raise_at_one, range(3), 1))
    assert results == {0: 0, 1: WorkerDied(1), 2: 2}
    assert "ValueError: one" in capfd.readouterr().err


def test_jobs_are_drawn_only_when_a_worker_is_free():
    drawn = []

    def jobs():
        for number in range(6):
            drawn.append(number)
            yield number

    trials = run_trials(square, jobs(), 2)
    next(trials)
    assert drawn == [0, 1, 2]
    trials.close()
    with pytest.raises(StopIteration):
        next(trials)


CAMPAIGN = """
import sys, time
from drake_tracker.core.processes.worker_pool import run_trials
sys.path.insert(0, sys.argv[1])
from endless import work
if __name__ == "__main__":
    list(run_trials(work, range(2), 2))
"""
WORK = """
import os, time
def work(job):
    open(f"worker{os.getpid()}", "w").close()
    time.sleep(600)
"""


def test_workers_end_when_the_campaign_is_killed(tmp_path):
    (tmp_path / "endless.py").write_text(WORK)
    (tmp_path / "campaign.py").write_text(CAMPAIGN)
    campaign = subprocess.Popen([sys.executable, "campaign.py", str(tmp_path)], cwd=tmp_path)
    deadline = time.monotonic() + 60.0
    while len(workers := [int(path.name[6:]) for path in tmp_path.glob("worker*")]) < 2:
        assert time.monotonic() < deadline and campaign.poll() is None
        time.sleep(0.05)
    campaign.kill()
    campaign.wait()
    deadline = time.monotonic() + 2.0
    while any(map(is_running, workers)):
        assert time.monotonic() < deadline, "a worker survives its campaign"
        time.sleep(0.05)


def is_running(number):
    """Whether there is a process with this number that has not ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
