"""Measures start-up times and the size of a recording.

    python benchmarks/start_up.py [--runs N] [--json FILE]

The times are those of ``drake-tracker --help`` as a process; of `make demo`, on a machine that is set up, until its
page shows the first camera image; and the processor time of a process that imports what a recorded run imports.
Median, minimum and maximum of several runs. The size is that of ``recording.html`` after half a minute.
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

from result_tables.speed_tables import start_up_table
from shared.common import print_table, save_json

from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario

ROOT = Path(__file__).resolve().parents[1]
DURATION = 30.0
"""Simulated time of the recording [s]."""
PATIENCE = 120.0
"""Longest time [s] to wait for a picture."""


def help_time():
    """Returns the wall time [s] of ``drake-tracker --help``."""
    start = time.monotonic()
    subprocess.run([sys.executable, "-m", "drake_tracker", "--help"], cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    return time.monotonic() - start


def import_time():
    """Returns the processor time [s] of a process that imports what a recorded run of the train imports."""
    modules = ("run.simulation", "run.camera_video", "run.motion_snapshot", "run.scene", "tasks.train.diagram")
    program = "; ".join(f"import drake_tracker.{module}" for module in modules)
    before = os.times()
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


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
            except urllib.error.HTTPError:  # no image yet
                time.sleep(0.05)
        raise TimeoutError(f"no image within {PATIENCE:g} s")
    finally:
        os.killpg(demo.pid, signal.SIGINT)
        demo.communicate()


def recording_size():
    """Returns the size [bytes] of a recording of `DURATION`; it needs no cameras."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = load_scenario("train:learned", overrides=["vision=!Measured {}", f"duration={DURATION}"])
        simulate(scenario, Path(folder), RunOptions(stop_when_over=False))
        return (Path(folder) / "recording.html").stat().st_size


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="runs of each command (default 5)")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    measures = {
        "drake-tracker --help": help_time,
        "imports of a run, processor time": import_time,
        "first image of make demo": first_picture_time,
    }
    results = {
        "seconds": {what: [measure() for _ in range(options.runs)] for what, measure in measures.items()},
        "recording_s": DURATION,
        "recording_bytes": recording_size(),
    }
    print_table(*start_up_table(results))
    save_json(results, options.json, [load_scenario("train:learned").seed])


if __name__ == "__main__":
    main()
