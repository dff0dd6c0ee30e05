"""Time of one update, of all contestants in turns on the same points, in processor time.

A busy machine slows all of them, so that their ratios are worth more than the absolute values.
"""

import time

import numpy as np
from contestants import OURS, contestant
from measure import rounded
from worlds import make_world

SEED = 5000
TURNS = 12
"""Stretches into which the run is cut; the median over them is reported."""
DURATION = 36.0
"""Of the run [s]; with it most updates of closed_path are on a learned path."""
NAMES = (*(name for name in OURS if name != "arc_length_literal"), "stonesoup_turn", "filterpy_turn")


def update_times(parameters, names=NAMES):
    """Returns for each name [mean time of an update [us], Stone Soup's over it in the same stretch], medians over
    `TURNS`, on the oval with white noise of 1 mm."""
    world = make_world("oval", "white", 0.001, "constant", SEED, DURATION)
    estimators = {name: contestant(name, 1.0, "constant", parameters) for name in names}
    states = {name: estimator.initial_state() for name, estimator in estimators.items()}
    spent = {name: [] for name in names}
    for stretch in np.array_split(np.arange(len(world.times)), TURNS):
        for name, estimator in estimators.items():
            state = states[name]
            start = time.process_time()
            for index in stretch:
                state = estimator.update(state, world.times[index], world.points[index])
            spent[name].append(1e6 * (time.process_time() - start) / len(stretch))
            states[name] = state
    reference = np.array(spent["stonesoup_turn"])
    return {
        name: [rounded(np.mean(values)), rounded(np.median(reference / np.array(values)))]
        for name, values in spent.items()
    }
