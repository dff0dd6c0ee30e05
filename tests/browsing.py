"""A run with the live view in a process of its own, and Debian's chromium, driven by Playwright, to watch it."""

import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]
NEVER_GRASPS = ["--set", "vision=!Measured {}", "--set", "grasp.settle_time=60", "--duration", "600"]
"""Options of a run that ends when it is interrupted."""
SELECTING = [
    *(
        "--set",
        "vision.method=!SilhouetteTracker {target: !Selected {}}",
        "--set",
        "objects=[!Train {body: striped, ahead: -0.6}]",
    ),
    *("--set", "grasp.settle_time=60", "--duration", "600"),
]
"""Options of a run with two trains that never grasps, and follows the one that is selected."""
PATIENCE = 120.0
"""Wall time [s] after which waiting for something fails the test."""


@contextmanager
def chromium(*flags):
    """A browser; skips the test where there is none."""
    if not CHROMIUM.exists():
        pytest.skip(f"the live view's browser test needs {CHROMIUM}: apt-get install chromium")
    api = pytest.importorskip("playwright.sync_api", reason="the live view's browser test needs playwright")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=[*FLAGS, *flags])
        yield browser
        browser.close()


@contextmanager
def live_run(folder, options=(), scenario="train"):
    """A run of the train; ``url`` of its page, ``out`` its directory, ``printed()`` what it printed."""
    out = folder / "run"
    command = [sys.executable, "-m", "drake_tracker", "run", scenario, "--live", "--out", str(out), *options]
    environment = {**os.environ, "LP_NUM_THREADS": "1"}
    with open(folder / "printed", "w+") as printed:
        run = subprocess.Popen(command, stdout=printed, stderr=subprocess.STDOUT, env=environment)
        run.out, run.printed = out, lambda: Path(printed.name).read_text()
        try:
            until(lambda: "Live view:" in run.printed() or run.poll() is not None)
            run.url = re.search(r"Live view: (\S+)", run.printed())[1]
            yield run
        finally:
            run.kill()
            run.wait()


def until(condition):
    """Waits until a condition holds; returns its value."""
    end = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < end
        time.sleep(0.05)
    return value
