"""Fits the law of success to measured descents."""

import math

import numpy as np
from scipy.optimize import minimize
from shared.common import print_table

from drake_tracker.core.timing import PATH_DURATION, SERVO_PERIOD
from drake_tracker.grasp.success_law import LAW, Law, followed_share, held_share, spread

SHARES = np.linspace(0.0, 1.0, 17)
MEMORIES = (0.005, 0.03, 0.06, 0.1, 0.15, 0.22, 0.35)
"""Lengths over which the filter averages the curvature [m], for which the stray of the path is computed."""
NUMBERS = ("horizon_s", "room_m", "noise_m", "speed", "turns", "demand")
"""Numbers of a row that the law rests on."""


def predicted(law, rows):
    """Returns the probability of success of each row, shape (n,)."""
    column = {key: np.array([row[key] for row in rows], dtype=float) for key in NUMBERS}
    tables, horizon, room = np.array([row["strays"] for row in rows]), column["horizon_s"], column["room_m"]
    memory = law.memory * column["speed"] + law.chord * column["noise_m"]
    place = np.interp(memory, MEMORIES, range(len(MEMORIES)))
    low = np.minimum(place.astype(int), len(MEMORIES) - 2)
    weight, each = (place - low)[:, None], range(len(rows))
    quantiles = (1.0 - weight) * tables[each, low] + weight * tables[each, low + 1]
    quantiles[is_known(rows)] = 0.0
    turns = column["turns"] > 0.0
    held = held_share(
        0.5 * (quantiles[:, 1:] + quantiles[:, :-1]), spread(law, column["noise_m"], horizon, turns) / room
    )
    return held * followed_share(law, column["demand"]) * (horizon + SERVO_PERIOD <= PATH_DURATION)


def is_known(rows):
    """Returns which objects had passed their whole path before the launch, seen by a filter that learns it."""
    return np.array(
        [
            row["closed"]
            and row["estimator"] == "closed path"
            and (row["launch_s"] or 0.0) * row["speed"] > row["length_m"]
            for row in rows
        ]
    )


def fit(rows):
    """Returns the `Law` of greatest likelihood, the standard deviation of each logarithm, and the loss of a run."""
    lifted = np.array([row["lifted"] for row in rows], dtype=float)

    def loss(logarithms):
        chance = np.clip(predicted(Law(*np.exp(logarithms)), rows), 1e-3, 1.0 - 1e-3)
        return -np.sum(lifted * np.log(chance) + (1.0 - lifted) * np.log(1.0 - chance))

    found = np.log(LAW)
    for _ in range(3):
        options = {"adaptive": True, "maxfev": 6000, "xatol": 1e-3, "fatol": 1e-3}
        found = minimize(loss, found, method="Nelder-Mead", options=options).x
    deviations = []
    for k in range(len(found)):  # from the second derivative of the loss
        step = 0.02 * np.eye(len(found))[k]
        bend = (loss(found + step) + loss(found - step) - 2.0 * loss(found)) / 0.02**2
        deviations.append(1.0 / math.sqrt(bend) if bend > 0.0 else math.inf)
    return Law(*np.exp(found)), deviations, loss(found) / len(rows)


def print_fit(rows):
    """Prints the law and how well its predictions agree with the runs to which it was fitted."""
    rows = [row for row in rows if row["end"] != "refused"]
    law, deviations, loss = fit(rows)
    for name, value, deviation in zip(Law._fields, law, deviations):
        print(f"{name:<14}{value:.4f}   standard deviation of its logarithm {deviation:.2f}")
    print(f"{len(rows)} runs, {loss:.3f} nats a run")
    chance, lifted = predicted(law, rows), np.array([row["lifted"] for row in rows])
    groups = np.array_split(np.argsort(chance), 10)
    print_table(
        ["runs", "predicted", "lifted"],
        [[len(group), f"{chance[group].mean():.3f}", f"{lifted[group].mean():.3f}"] for group in groups],
    )
