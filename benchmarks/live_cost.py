"""Measures what the live view costs: the real-time factor of a run of the train with and without a connected page.

    OPENBLAS_NUM_THREADS=1 python benchmarks/live_cost.py [--turns N] [--duration S] [--json FILE]

Runs of `train:learned`, recorded as by `drake-tracker run train:learned --live`, take turns, with one seed: alone,
watched, and in a browser. The watcher is a separate process that fetches what the page fetches: every event and each
new frame. It draws nothing, like a browser with a graphics card, which takes no processor from the run. The browser is
Debian's chromium, which draws without a graphics card; without chromium and Playwright there are no such runs. The
first simulated seconds do not count, because caches are cold and the browser compiles the page. Processor time is that
of the run's own process.
"""

import argparse
import json
import multiprocessing
import tempfile
import time
import urllib.request
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from result_tables.speed_tables import watchers_table
from shared.common import print_table, save_json

from drake_tracker import load_scenario, simulate
from drake_tracker.live.view import LiveView

WARM_UP = 3.0
CHROMIUM = Path("/usr/bin/chromium")
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking"]


class Stopwatch:
    """A progress callback of `simulate` that measures wall and processor time [s] per simulated second."""

    def __init__(self):
        self._first = self._last = None

    def __call__(self, now, phase):
        if now < WARM_UP:
            return
        self._last = np.array([now, time.perf_counter(), time.process_time()])
        self._first = self._last if self._first is None else self._first

    def cost(self):
        """Returns (wall, processor) time per simulated second."""
        simulated, *spent = self._last - self._first
        return np.array(spent) / simulated


def fetch(url, over):
    """Fetches events and frames as the page does until the run ends, which also sets ``over``."""
    for line in urllib.request.urlopen(f"{url}events"):
        if line.startswith(b"data: ") and json.loads(line[6:]).get("frame"):
            urllib.request.urlopen(f"{url}frame.jpg").read()


def browse(url, over):
    """Opens the page in a browser until ``over`` is set."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(url)
        over.wait()
        browser.close()


def run(seed, duration, watch):
    """Returns the cost of a run that ``watch``, a function of the page's address or None, watches."""
    stopwatch = Stopwatch()
    scenario = load_scenario("train:learned", seed=seed, duration=duration, overrides=["grasp.settle_time=60"])
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        live = watcher = None
        spawn = multiprocessing.get_context("spawn")
        over = spawn.Event()
        if watch is not None:
            live = stack.enter_context(LiveView())
            watcher = spawn.Process(target=watch, args=(live.url, over))
            watcher.start()
            while not live.state.watchers:
                time.sleep(0.05)
        simulate(scenario, Path(folder), progress=stopwatch, live=live)
        over.set()
    if watcher is not None:
        watcher.join()
    return stopwatch.cost()


def has_browser():
    """Returns whether there are chromium and Playwright."""
    try:
        import playwright  # noqa: F401
    except ImportError:
        return False
    return CHROMIUM.exists()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=5, help="runs of each kind")
    parser.add_argument("--duration", type=float, default=13.0, help="simulated time of each run [s]")
    parser.add_argument("--seed", type=int, default=0, help="default 0")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    kinds = {"alone": None, "page is fetched": fetch, **({"page open in a browser": browse} if has_browser() else {})}
    costs = {kind: [] for kind in kinds}
    for turn in range(options.turns):
        for kind in list(kinds) if turn % 2 == 0 else reversed(kinds):  # a drift of the load affects all alike
            costs[kind].append(run(options.seed, options.duration, kinds[kind]).tolist())
            print(f"{kind:<24} {1 / costs[kind][-1][0]:.2f} of real time", flush=True)
    results = {"costs": costs}
    print_table(*watchers_table(results))
    save_json(results, options.json, [options.seed])


if __name__ == "__main__":
    main()
