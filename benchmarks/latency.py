"""Measures how accurately `drake-tracker lag` finds a known latency, on synthetic photographs of a screen, or a light.

    python benchmarks/latency.py [--seeds N] [--json FILE]

Each clip has 90 photographs of 320 x 240 px (`tests/screens.py`). Its seed decides the latency (0 to 200 ms), the phase
of screen and camera, the jitter of the stamps (standard deviation 0.5 ms) and the noise. A clip has failed when fewer
than ten images are readable. The light is switched 60 times, in the same way as by `cameras/latency/light.py`.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from result_tables.latency_tables import TABLES
from shared.common import print_table, save_json

from drake_tracker.cameras.latency.light import LONGEST, SHORTEST, switch_bounds
from drake_tracker.cameras.latency.measurement import estimate_latency, measure_by_code
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from screens import Screen

FIRST_SEED = 9400
COUNT, JITTER = 90, 0.0005
CONDITIONS = {
    "60 Hz screen, 29.2 images/s": ({}, 29.2),
    "scanned from top to bottom in 14 ms": ({"scan": 0.014}, 29.2),
    "the same, rolling shutter of 25 ms": ({"scan": 0.014, "rolling": 0.025}, 29.2),
    "exposure of 30 ms": ({"exposure": 0.030, "scan": 0.014}, 29.2),
    "out of focus, noise of 10 grey values": ({"blur": 2.0, "noise": 10.0, "scan": 0.014}, 29.2),
    "144 Hz screen, 59.3 images/s": ({"refresh": 1.0 / 72.0, "scan": 0.006}, 59.3),
    "turned by 30 degrees, 50 Hz screen, 24.3 images/s": ({"refresh": 0.02, "turn": 0.52, "scan": 0.016}, 24.3),
    "in step: 60 Hz screen, 30 images/s": ({"scan": 0.014}, 30.0),
}
"""{name: (arguments of `Screen`, images per second)}."""


def measure_screen(arguments, rate, seed):
    """Returns (true latency, `Latency` or None) of a clip."""
    rng = np.random.default_rng(seed)
    latency, start = rng.uniform(0.0, 0.2), rng.uniform(0.0, 100.0)
    screen = Screen(**arguments)
    exposed = start + np.arange(COUNT) / rate
    stamps = exposed + latency + rng.normal(0.0, JITTER, COUNT)

    def frames():
        for time, stamp in zip(exposed, stamps):
            yield float(stamp), np.repeat(screen.photograph(time, rng)[..., None], 3, axis=2)

    footage = Footage("clip", screen.size, frames, times=stamps, epoch=0.0)
    try:
        return latency, measure_by_code(footage).latency
    except DrakeTrackerError:
        return latency, None


def measure_light(seed, rate=29.97, exposure=0.02):
    """Returns (true latency, `Latency`) of a light: one block in 768 follows it, the others are noise."""
    rng = np.random.default_rng(seed)
    latency = rng.uniform(0.0, 0.2)
    times = np.cumsum(rng.uniform(SHORTEST, LONGEST, 60))
    states = np.arange(60) % 2
    stamps = np.arange(0.0, times[-1] + 0.5, 1.0 / rate)
    stamps = stamps + rng.normal(0.0, JITTER, len(stamps))
    fine = np.linspace(-0.5, 0.5, 41) * exposure
    place = np.searchsorted(times, stamps[:, None] - latency + fine, "right") - 1
    share = np.where(place >= 0, states[np.maximum(place, 0)], 1 - states[0]).mean(axis=1)
    blocks = rng.normal(60.0, 1.0, (len(stamps), 768))
    blocks[:, 300] += 60.0 * share
    return latency, estimate_latency(*switch_bounds(stamps, blocks, times, states, (-0.2, 3.0)))


def summarise(name, pairs):
    """Returns the result of a condition."""
    found = [(estimate.seconds - truth, estimate.uncertainty) for truth, estimate in pairs if estimate is not None]
    errors = 1e3 * np.abs([error for error, _ in found])
    return {
        "cell": name,
        "clips": len(pairs),
        "failed": len(pairs) - len(found),
        "median_ms": float(np.median(errors)),
        "worst_ms": float(errors.max()),
        "within_2_ms": int((errors <= 2.0).sum()),
        "within_uncertainty": int(sum(abs(error) <= uncertainty for error, uncertainty in found)),
        "uncertainty_ms": 1e3 * float(np.median([uncertainty for _, uncertainty in found])),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10, help="number of clips of each condition (default 10)")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    args = parser.parse_args()
    seeds = range(FIRST_SEED, FIRST_SEED + args.seeds)
    cells = []
    for name, (arguments, rate) in CONDITIONS.items():
        cells.append(summarise(name, [measure_screen(arguments, rate, seed) for seed in seeds]))
        print(cells[-1], file=sys.stderr, flush=True)
    cells.append(summarise("light, switched 60 times", [measure_light(seed) for seed in seeds]))
    print_table(*TABLES["accuracy"](cells))
    save_json([{"part": "accuracy", "cells": cells}], args.json, seeds)


if __name__ == "__main__":
    main()
