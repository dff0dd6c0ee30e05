"""Tests of the check of this machine. A renderer that crashes does not crash the test process."""

import pytest

from drake_tracker.core import system_check as machine
from drake_tracker.core.errors import DrakeTrackerError


def test_the_machine_that_runs_the_tests_passes_the_check(capsys):
    assert machine.main() == 0
    out = capsys.readouterr().out
    for what in ("Python", "drake", "opencv-python-headless", "libegl1", "libgl1-mesa-dri", "models", "renderer"):
        assert what in out
    assert "BAD" not in out


@pytest.mark.parametrize(
    "probe, said",
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"),
        ("raise RuntimeError('no display')", "RuntimeError: no display"),
        ("import time; time.sleep(60)", "no image within"),
        ("import sys; sys.exit(3)", "exit code 3"),
    ],
)
def test_a_broken_renderer_gives_one_line_with_the_remedy(monkeypatch, probe, said):
    monkeypatch.setattr(machine, "_PROBE", probe)
    trouble = machine.probe_renderer(timeout=1.0)
    assert said in trouble
    monkeypatch.setattr(machine, "probe_renderer", lambda: trouble)
    machine.require_renderer.cache_clear()
    with pytest.raises(DrakeTrackerError) as caught:
        machine.require_renderer()
    assert said in str(caught.value) and machine.APT_LINE in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_renderer_that_works_is_tried_once_and_a_broken_one_every_time(monkeypatch):
    answers = iter(["signal 11", "signal 11", None])
    monkeypatch.setattr(machine, "probe_renderer", lambda: next(answers))
    machine.require_renderer.cache_clear()
    for _ in range(2):
        with pytest.raises(DrakeTrackerError, match="signal 11"):
            machine.require_renderer()
    for _ in range(2):
        machine.require_renderer()


def test_what_is_missing_is_marked_with_the_remedy(monkeypatch, capsys):
    monkeypatch.setattr(machine, "_MESA_DRIVERS", ())
    monkeypatch.setattr(machine, "PACKAGES", ("no-such-package",))
    monkeypatch.setattr(machine, "PYTHONS", ((2, 6), (2, 7)))
    monkeypatch.setattr(machine, "probe_renderer", lambda: "signal 11")
    assert machine.main() == 2
    bad = [line for line in capsys.readouterr().out.splitlines() if line.startswith("BAD")]
    assert [line.split()[1] for line in bad] == ["Python", "no-such-package", "libgl1-mesa-dri", "renderer"]
    assert machine.APT_LINE in bad[2]
