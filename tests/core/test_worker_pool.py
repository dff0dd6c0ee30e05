"""Trials in worker processes: all are done, and one that kills its worker costs itself alone."""

import os
import signal

import pytest

from drake_tracker.core.worker_pool import FRESH_AFTER, WorkerDied, run_trials


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
    # Two at a time; each makes way for a new one after FRESH_AFTER.
    assert len({process for _, process in results.values()}) >= 3


def test_a_worker_that_dies_costs_its_own_trial_alone():
    results = dict(run_trials(die_of_seven, range(12), 2))
    assert results.pop(7) == WorkerDied(-signal.SIGKILL)
    assert results == {number: number for number in range(12) if number != 7}


class DeadlyToLoad:
    """Work that ends the process which unpickles it, before that process has read a job."""

    def __reduce__(self):
        return os._exit, (3,)


def test_a_worker_that_dies_before_it_reads_its_job_costs_that_job_alone():
    assert dict(run_trials(DeadlyToLoad(), range(2), 1)) == {0: WorkerDied(3), 1: WorkerDied(3)}


def test_an_exception_counts_as_a_death(capfd):
    results = dict(run_trials(raise_at_one, range(3), 1))
    assert results == {0: 0, 1: WorkerDied(1), 2: 2}
    assert "ValueError: one" in capfd.readouterr().err


def test_jobs_are_taken_only_as_workers_are_free():
    taken = []

    def jobs():
        for number in range(6):
            taken.append(number)
            yield number

    trials = run_trials(square, jobs(), 2)
    next(trials)
    assert taken == [0, 1, 2]
    trials.close()
    with pytest.raises(StopIteration):
        next(trials)
