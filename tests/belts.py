"""Belts with few parts, for the tests of the dispatchers."""

import math

import numpy as np

from drake_tracker.dispatch import Candidate, Cell, CycleModel, CycleTime, Eligibility, FreeHand, PickWindow

MODEL = CycleModel(CycleTime(), PickWindow())
ELIGIBILITY = Eligibility()
CELLS = tuple(Cell(x, side * (0.19 + 0.065 * row)) for side in (1, -1) for row in range(6) for x in (0.345, 0.410))
START = FreeHand(0.38, 0.0, 0.0)


def part(number, x=0.60, y=0.0, v=0.10, std=0.001, clear=math.inf, kind=0):
    return Candidate(number, kind, x, y, 0.0, v, std, clear)


def random_parts(seed, count, first=-0.45, last=0.30):
    """Parts at random places and with different speeds; the numbers do not follow the places."""
    rng = np.random.default_rng(seed)
    return [
        part(number, rng.uniform(0.5, 0.7), rng.uniform(first, last), rng.uniform(0.05, 0.15))
        for number in range(1, count + 1)
    ]
