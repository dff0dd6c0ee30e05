"""What a newcomer waits for, and carries: the help, the first picture of the demonstration, a recording.

    python benchmarks/start_up.py [--runs N]

`--help` as a whole process; `make demo`, on a machine that is set up, until its page has the first camera image; and
the size of ``recording.html`` of half a minute. Medians, and the slowest, of so many runs.
"""

import argparse
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

from common import print_table

from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario

ROOT = Path(__file__).resolve().parents[1]
DURATION = 30.0
"""Of the recording [s]."""
PATIENCE = 120.0
"""Longest time [s] that a picture is waited for."""


def help_time():
    """Returns the wall time [s] of ``drake-tracker --help``."""
    start = time.monotonic()
    subprocess.run([sys.executable, "-m", "drake_tracker", "--help"], cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    return time.monotonic() - start


def first_picture_time():
    """Returns the wall time [s] from the start of ``make demo`` to the first camera image of its page."""
    start = time.monotonic()
    demo = subprocess.Popen(
        ["make", "-s", "demo"], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        link = next(found.group() for line in demo.stdout if (found := re.search(r"http://\S+", line)))
        while time.monotonic() - start < PATIENCE:
            try:
                with urllib.request.urlopen(f"{link.rstrip('/')}/frame.jpg", timeout=5.0) as answer:
                    answer.read()
                return time.monotonic() - start
            except urllib.error.HTTPError:  # there is none yet
                time.sleep(0.05)
        raise TimeoutError(f"no picture within {PATIENCE:g} s")
    finally:
        os.killpg(demo.pid, signal.SIGINT)
        demo.communicate()


def recording_size():
    """Returns the size [bytes] of a recording of `DURATION`; there is no need for cameras."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = load_scenario("train", overrides=["vision=!Measured {}", f"duration={DURATION}"])
        simulate(scenario, out=Path(folder), stop=False)
        return (Path(folder) / "recording.html").stat().st_size


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    rows = []
    for what, measure in (("drake-tracker --help", help_time), ("first picture of make demo", first_picture_time)):
        times = [measure() for _ in range(options.runs)]
        rows.append((what, f"{statistics.median(times):.2f} s", f"{max(times):.2f} s"))
    rows.append((f"recording.html of {DURATION:g} s", f"{1e-6 * recording_size():.1f} MB", ""))
    print_table(("what", "median", "most"), rows)


if __name__ == "__main__":
    main()
