"""A campaign on a cluster: a real scheduler and worker processes, some of which are killed."""

import gc
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from campaign_trials import die_of_seed_1, quick, slow

from drake_tracker.campaign import cluster as cluster_module
from drake_tracker.campaign.cluster import cluster
from drake_tracker.campaign.directory import read_lines
from drake_tracker.campaign.plan import make_plan
from drake_tracker.campaign.pool import pool
from drake_tracker.campaign.run import carry_out
from drake_tracker.core.errors import DrakeTrackerError

TESTS = Path(__file__).parents[1]
FEW_FAILURES = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
"""A trial is lost with the second worker that it kills, since starting a worker takes seconds."""


class Engine:
    """A scheduler and workers, started as a user starts them."""

    def __init__(self, folder):
        self.folder = folder
        self.processes = []
        self.scheduler = self.start("scheduler", "--port", "0", "--scheduler-file", str(folder / "scheduler.json"))
        self.address = self.wait_for(lambda: address_in(folder / "scheduler.json"))

    def start(self, what, *arguments):
        path = os.pathsep.join([str(TESTS.parent), str(TESTS), os.environ.get("PYTHONPATH", "")])
        process = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_" + what, "--host", "127.0.0.1", "--no-dashboard", *arguments],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": path, **FEW_FAILURES},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.processes.append(process)
        return process

    def worker(self, *arguments):
        return self.start("worker", self.address, "--nthreads", "1", "--local-directory", str(self.folder), *arguments)

    @staticmethod
    def wait_for(condition, timeout=30.0):
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            found = condition()
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError("it did not come up")

    def close(self):
        for process in reversed(self.processes):  # workers end when their nanny is gone
            process.kill()
            process.wait()


def address_in(path):
    try:
        return json.loads(path.read_text())["address"]
    except (FileNotFoundError, ValueError):  # not yet written, or only in part
        return None


@pytest.fixture
def engine(tmp_path):
    gc.collect()  # a client that did not connect deadlocks dask when it is collected while another one starts
    (tmp_path / "engine").mkdir()
    engine = Engine(tmp_path / "engine")
    yield engine
    engine.close()


def plan(trials):
    return make_plan("train:learned", trials, {"track.speed": ["0.1", "0.3"]})


def test_a_killed_worker_costs_no_trial(engine, tmp_path):
    workers = {process.pid: process for process in (engine.worker("--no-nanny"), engine.worker("--no-nanny"))}
    killed = []

    def progress(ended, trials, taken):
        lines = read_lines(tmp_path / "c" / "trials.jsonl")
        if not killed and len({line["process"] for line in lines}) == 2:
            killed.append(lines[-1]["process"])
            os.kill(killed[0], signal.SIGKILL)

    campaign = carry_out(plan(6), cluster(engine.address), tmp_path / "c", progress=progress, work=slow)
    assert killed and killed[0] in workers, "both took part, and one was killed"
    (survivor,) = set(workers) - set(killed)
    lines = read_lines(tmp_path / "c" / "trials.jsonl")
    assert len(lines) == len({(line["settings"]["track.speed"], line["seed"]) for line in lines}) == 12
    assert campaign.lost == [] and {line["process"] for line in lines[-4:]} == {survivor}


def test_only_the_trial_that_kills_its_workers_is_lost(engine, tmp_path):
    engine.worker("--nworkers", "2")
    campaign = carry_out(make_plan("train:learned", 4), cluster(engine.address), tmp_path / "c", work=die_of_seed_1)
    assert [row["seed"] for row in campaign.rows] == [0, 2, 3]
    ((trial, reason),) = campaign.lost
    assert trial.scenario.seed == 1 and "KilledWorker" in reason


def test_after_the_scheduler_dies_the_campaign_continues_elsewhere(engine, tmp_path):
    engine.worker("--no-nanny")

    def progress(ended, trials, taken):
        if ended == 3:
            engine.scheduler.kill()

    with pytest.raises(DrakeTrackerError) as caught:
        carry_out(plan(6), cluster(engine.address), tmp_path / "c", progress=progress, work=slow)
    message = str(caught.value)
    assert "the scheduler is gone" in message and "of 12 trials are kept, continue with --out" in message
    assert "\n" not in message
    kept = read_lines(tmp_path / "c" / "trials.jsonl")
    assert 3 <= len(kept) < 12
    campaign = carry_out(plan(6), pool(1), tmp_path / "c", work=quick)
    assert len(campaign.rows) == 12 and read_lines(tmp_path / "c" / "trials.jsonl")[: len(kept)] == kept


def test_a_scheduler_without_workers_is_one_line(engine, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "WORKERS_TIMEOUT", 0.5)
    with pytest.raises(DrakeTrackerError, match="it has had no worker for 0.5 s; start one: dask worker tcp://"):
        carry_out(plan(1), cluster(engine.address), tmp_path / "c", work=quick)
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    "address, said",
    [
        ("tcp://127.0.0.1:9", "no scheduler answers there within 0.5 s"),
        ("sky://there", "not an address such as"),
        ("nonsense", "scheduler"),
    ],
)
def test_a_missing_scheduler_is_one_line(address, said, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "CONNECT_TIMEOUT", 0.5)
    with pytest.raises(DrakeTrackerError, match=said) as caught:
        carry_out(plan(1), cluster(address), tmp_path / "c", work=quick)
    assert "\n" not in str(caught.value) and not (tmp_path / "c").exists()


def test_workers_of_another_version_are_refused(engine, tmp_path, monkeypatch):
    engine.worker("--no-nanny")
    monkeypatch.setattr(cluster_module, "__version__", "9.9")
    with pytest.raises(DrakeTrackerError, match="needs drake_tracker 9.9, and has 0"):
        carry_out(plan(1), cluster(engine.address), tmp_path / "c", work=quick)
