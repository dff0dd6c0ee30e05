"""Ctrl-C, SIGTERM and SIGHUP end a command in the same way, and not in the middle of an import or a file."""

import importlib
import signal
import subprocess
import sys
import time

import pytest

from drake_tracker.core.processes import signals
from drake_tracker.core.processes.signals import Interrupted, graceful, held, on_signal

HANDLERS = [signal.getsignal(signum) for signum in signals.REQUESTS]
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}


@pytest.fixture(autouse=True)
def unchanged():
    yield
    assert [signal.getsignal(signum) for signum in signals.REQUESTS] == HANDLERS


@pytest.mark.parametrize("signum", signals.REQUESTS)
def test_every_signal_is_a_keyboard_interrupt_with_its_exit_code(signum):
    with graceful():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signum)
        assert signals.received() == signum and signals.exit_code() == CODES[signum]
    assert signals.received() is None


def test_nohup_is_respected():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with graceful(), held() as postponed:
            signal.raise_signal(signal.SIGHUP)
            assert postponed == [] and signals.received() is None
    finally:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


def test_an_action_replaces_the_exception():
    seen = []
    with graceful():
        with on_signal(seen.append):
            for signum in signals.REQUESTS:
                signal.raise_signal(signum)
        assert seen == list(signals.REQUESTS) and signals.received() == signal.SIGINT


@pytest.mark.parametrize("handler", [signal.SIG_DFL, signal.SIG_IGN])
def test_without_the_command_line_a_signal_that_kills_or_is_ignored_still_is(handler):
    """The workers of a campaign ignore Ctrl-C, and their parent ends them by SIGTERM."""
    for signum in (signal.SIGTERM, signal.SIGINT):
        before = signal.signal(signum, handler)
        try:
            with on_signal(lambda signum: None):
                assert signal.getsignal(signum) == handler
        finally:
            signal.signal(signum, before)


def test_a_postponed_signal_is_raised_once_at_the_end():
    done = []

    def write():
        with held():
            for _ in range(3):
                signal.raise_signal(signal.SIGTERM)
            done.append("written")

    with graceful(), pytest.raises(Interrupted):
        write()
    assert done == ["written"]


def test_a_postponed_signal_can_be_dropped():
    with graceful(), held() as postponed:
        signal.raise_signal(signal.SIGINT)
        assert postponed == [signal.SIGINT]
        postponed.clear()


def test_a_signal_during_an_import_waits_for_its_end(tmp_path, monkeypatch):
    (tmp_path / "slowly_imported.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\ncomplete = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    with graceful():
        assert importlib.import_module("slowly_imported").complete
        with pytest.raises(Interrupted):
            time.sleep(5.0)


def test_an_interrupted_import_of_native_code_is_recognised():
    error = ImportError("initialization failed")
    assert not signals.was_interrupted(error)
    error.__cause__ = SystemError()
    error.__cause__.__context__ = KeyboardInterrupt()
    assert signals.was_interrupted(error)


START_UP = """
import signal, sys
from drake_tracker import cli

class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy._core.einsumfunc":  # numpy is imported by Drake's native code
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
sys.exit(cli.main(["run", "train", "--set", "vision=!Measured {}", "--out", "run"]))
"""


def test_ctrl_c_during_start_up_is_one_line(tmp_path):
    child = subprocess.run([sys.executable, "-c", START_UP], capture_output=True, text=True, cwd=tmp_path)
    assert child.returncode == 130
    assert child.stderr.splitlines()[-1] == "drake-tracker: interrupted"
    assert "ImportError" not in child.stderr and "At:" not in child.stderr and "Traceback" not in child.stderr
    assert list(tmp_path.iterdir()) == []
