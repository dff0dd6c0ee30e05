"""However a run ends, what was recorded until then is kept."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
import types

import numpy as np
import pytest

from drake_tracker import cli, load_scenario, simulate
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import LOG_FILE, STREAM_FILE, load_log
from drake_tracker.core.processes.signals import Interrupted, graceful
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import _advance
from drake_tracker.tasks.train.task import TrainTask

MEASURED = "vision=!Measured {}"
WRITTEN = {"scenario.yaml", LOG_FILE, "summary.json", "tracking.png"}
END = 0.3
"""Simulated time at which something ends the run [s]."""


@pytest.fixture
def run(tmp_path):
    """Runs a train for up to a second; ``happen`` is called at `END`."""

    def start(happen):
        scenario = load_scenario("train:learned", duration=1.0, overrides=[MEASURED])

        def progress(now, phase):
            if now > END:
                happen()

        with graceful():
            return simulate(scenario, tmp_path / "run", RunOptions(record=False), progress=progress)

    return start


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_a_signal_ends_the_run_and_further_ones_do_not_end_the_writing(run, tmp_path, monkeypatch):
    draw = TrainTask.draw

    def interrupted(*arguments):
        signal.raise_signal(signal.SIGTERM)
        draw(*arguments)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(TrainTask, "draw", interrupted)
    summary = run(lambda: signal.raise_signal(signal.SIGTERM))
    assert summary["interrupted"] and END < summary["simulated_s"] < END + 0.1
    assert names(tmp_path / "run") == WRITTEN
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["interrupted"] is True
    assert load_log(tmp_path / "run")["point"].times[-1] == pytest.approx(summary["simulated_s"], abs=0.02)


def test_a_first_ctrl_c_during_the_writing_takes_effect_when_everything_is_written(run, tmp_path, monkeypatch):
    draw = TrainTask.draw
    monkeypatch.setattr(TrainTask, "draw", lambda *all_: (signal.raise_signal(signal.SIGINT), draw(*all_)))
    with pytest.raises(Interrupted):
        run(lambda: None)
    assert names(tmp_path / "run") == WRITTEN
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["interrupted"] is False


def test_a_custom_part_that_ends_the_process_ends_the_run_and_it_is_kept(run, tmp_path, monkeypatch):
    """Drake also raises SystemExit, for numbers that are not finite."""
    monkeypatch.setattr(TrainTask, "draw", lambda *_: sys.exit("another one, while drawing"))
    with pytest.raises(SystemExit, match="^a condition failed$"):
        run(lambda: sys.exit("a condition failed"))
    assert names(tmp_path / "run") == WRITTEN - {"tracking.png"}
    assert load_log(tmp_path / "run")["point"].times[-1] > END - 0.1


@pytest.mark.parametrize(
    "error", [RuntimeError("from Drake"), SystemExit("from Drake"), KeyboardInterrupt(), MemoryError()]
)
def test_whatever_is_raised_after_the_first_instant_is_returned_and_not_raised(error):
    class FailingSimulator:
        now = 1.0

        def Initialize(self):
            pass

        def AdvanceTo(self, time):
            raise error

        def get_context(self):
            return types.SimpleNamespace(get_time=lambda: self.now)

    simulator, monitor = FailingSimulator(), types.SimpleNamespace(interrupted=False)
    assert _advance(simulator, monitor, 2.0, None) is error and monitor.interrupted
    simulator.now = 0.0
    with pytest.raises(type(error)):
        _advance(simulator, monitor, 2.0, None)


def test_a_disk_that_fills_up_during_the_run_ends_it_in_one_line_and_keeps_what_is_there(run, tmp_path, monkeypatch):
    monkeypatch.setattr("drake_tracker.run.log_recorder.STREAM_PERIOD", 0.01)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    folder = tmp_path / "run"

    def fill():
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))  # more than scenario and summary, less than the log

    def restore():
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))

    try:
        with pytest.raises(DrakeTrackerError) as caught:
            run(fill)
    finally:
        restore()
    said = str(caught.value)
    assert said.startswith(f"{folder}/") and said.endswith("cannot be written: File too large") and "\n" not in said
    assert names(folder) >= {"scenario.yaml", "summary.json"}
    assert not any(name.startswith(".") for name in names(folder))
    assert load_log(folder)["point"].times[-1] == pytest.approx(END, abs=0.05)


RUN = [sys.executable, "-m", "drake_tracker", "run", "train", "--no-record", "--set", MEASURED, "--out", "run"]


def test_a_killed_run_is_read_up_to_the_last_second_and_its_directory_is_not_shared(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    environment = {**os.environ, "LP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen(RUN, stderr=subprocess.DEVNULL, env=environment)
    stream = tmp_path / "run" / STREAM_FILE
    try:
        claimed = False
        while process.poll() is None and not (stream.exists() and stream.stat().st_size > 500_000):
            if not claimed and (tmp_path / "run").exists():
                claimed = True
                assert cli.main(RUN[3:]) == 2  # before anything is in the directory, or after
            time.sleep(0.02)
        assert process.poll() is None, "the run ended by itself"
    finally:
        process.kill()
        process.wait()
    assert claimed and "drake-tracker: the run directory run is" in capsys.readouterr().err
    assert names(tmp_path / "run") == {"scenario.yaml", STREAM_FILE}
    log = load_log(tmp_path / "run")
    end = log["point"].times[-1]
    assert end >= 1.5 and "tool" in log
    assert all(abs(signal.times[-1] - end) < 0.05 for signal in log.values())
    assert all(np.isfinite(signal.data).all() for signal in log.values())

    monkeypatch.setattr("drake_tracker.core.processes.loopback_server.LoopbackServer.serve_forever", lambda _: None)
    assert cli.main(["view", "run", "--no-browser", "--port", "0"]) == 0
    printed = capsys.readouterr().out
    assert "There is no summary" in printed and f"{STREAM_FILE}, up to {end:.1f} s" in printed
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Phases" in page and "no verdict" in page

    assert cli.main(["replay", "run", "--out", "replay"]) == 0
    assert json.loads((tmp_path / "replay" / "replay.json").read_text())["identical"] is True
    assert f"{STREAM_FILE}, up to {end:.1f} s" in capsys.readouterr().err


def test_a_log_that_does_not_fit_into_memory_is_refused_before_the_run(tmp_path, monkeypatch):
    """The log of a train takes 21 MB per simulated minute, and a run may last ten hours."""
    pages = {"SC_PHYS_PAGES": 1000, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(os, "sysconf", pages.__getitem__)
    scenario = load_scenario("train:learned", overrides=["vision=!Measured {}"], duration=60.0)
    with pytest.raises(DrakeTrackerError, match=r"the log of 60 s takes up to .* at most [1-9][0-9]? s fit"):
        simulate(scenario, tmp_path / "run")
    assert not (tmp_path / "run").exists()
