"""Measures what the live view costs: the real-time factor of a run of the train with and without a connected page.

    python benchmarks/live_cost.py [--pairs N] [--duration S] [--json FILE]

Runs of the default scenario, recorded as by `drake-tracker run train`, take turns: alone and watched, with one seed.
The watcher is a separate process that fetches what the page fetches: every event and each new frame. It draws nothing,
because a browser with a GPU takes no core from the run. The first simulated second does not count, because caches are
cold. Wall time depends on the machine's other load, the processor time of the run's own process hardly does.
"""

import argparse
import json
import multiprocessing
import tempfile
import time
import urllib.request
from pathlib import Path

import numpy as np
from common import print_table, save_json

from drake_tracker import load_scenario, simulate
from drake_tracker.live.view import LiveView

WARM_UP = 1.0
ALLOWED = 0.10
"""Largest relative increase of the wall time."""


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


def watch(url, counts):
    """Fetches events and frames as the page does until the run ends; puts (events, frames) into a queue."""
    events = frames = 0
    for line in urllib.request.urlopen(f"{url}events"):
        if line.startswith(b"data: "):
            events += 1
            news = json.loads(line[6:])
            if news.get("frame"):
                frames += len(urllib.request.urlopen(f"{url}frame.jpg").read()) > 0
    counts.put((events, frames))


def run(seed, duration, watched):
    """Returns the cost of a run and what its watcher received."""
    stopwatch = Stopwatch()
    scenario = load_scenario("train", seed=seed, duration=duration)
    with tempfile.TemporaryDirectory() as folder:
        if not watched:
            simulate(scenario, Path(folder), progress=stopwatch)
            return stopwatch.cost(), None
        spawn = multiprocessing.get_context("spawn")
        counts = spawn.Queue()
        with LiveView() as live:
            watcher = spawn.Process(target=watch, args=(live.url, counts))
            watcher.start()
            while not live.state.watchers:
                time.sleep(0.05)
            simulate(scenario, Path(folder), progress=stopwatch, live=live)
        got = counts.get(timeout=10)
        watcher.join()
        return stopwatch.cost(), got


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=3, help="runs of each kind")
    parser.add_argument("--duration", type=float, default=8.0, help="simulated time of each run [s]")
    parser.add_argument("--seed", type=int, default=0, help="default 0")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    costs = {False: [], True: []}
    for pair in range(options.pairs):
        for watched in (False, True) if pair % 2 == 0 else (True, False):  # a drift of the load affects both alike
            cost, got = run(options.seed, options.duration, watched)
            costs[watched].append(cost)
            seen = f", {got[0]} events and {got[1]} frames" if got else ""
            print(f"{'watched' if watched else 'alone':<8} {1 / cost[0]:.2f} of real time{seen}", flush=True)
    alone, watched = (np.array(costs[kind]) for kind in (False, True))
    rows = [
        [kind, f"{len(each) / each[:, 0].sum():.2f}", f"{each[:, 0].mean():.3f}", f"{each[:, 1].mean():.3f}"]
        for kind, each in (("alone", alone), ("watched", watched))
    ]
    print_table(["run", "real-time factor", "wall time per simulated second [s]", "processor time [s]"], rows)
    wall, processor = watched.mean(axis=0) / alone.mean(axis=0) - 1.0
    print(f"live view: {wall:+.1%} wall time, {processor:+.1%} processor time (wanted: at most {ALLOWED:.0%})")
    results = {"alone": alone.tolist(), "watched": watched.tolist(), "wall": wall, "processor": processor}
    save_json(results, options.json, [options.seed])


if __name__ == "__main__":
    main()
