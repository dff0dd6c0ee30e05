"""A test for a bounce: a sudden change of the velocity, from the motion that was expected a few points ago.

From a bounce on, the offsets of the points from their expected places grow steadily in one direction, from zero at an
instant between two images. After a jump they stay as they are, and an outlier is a jump of the newest point alone. As
in `drake_tracker.estimation.speed_change`, each instant is tried with its most likely size.
"""

from typing import NamedTuple

import numpy as np

from drake_tracker.estimation.speed_change import PLACE_STD, REFERENCE_NOISE, SPEED_STD

INSTANTS = 4
"""Number of instants between two points at which a bounce is tried."""
FEWEST_AFTER = 2
"""Number of points after a bounce that are needed to tell it from an outlier."""
LARGEST_MISFIT = 0.15
"""Largest share of the squared offsets after a bounce that the bounce does not explain."""


class Bounce(NamedTuple):
    """The most likely change of the velocity.

    Attributes:
        after: number of points since then.
        gain: change of the velocity, shape (d,) [m/s].
        evidence: twice the logarithm of the likelihood ratio of the bounce and no bounce, for `REFERENCE_NOISE`.
        margin: the same of the bounce and the most likely jump.
        misfit: share of the squared offsets since then that it does not explain.
    """

    after: int
    gain: np.ndarray
    evidence: float
    margin: float
    misfit: float


def most_likely_bounce(times: np.ndarray, away: np.ndarray) -> Bounce | None:
    """Returns the most likely bounce, None if there are too few points.

    Args:
        times: times of the points after that of the state from which they were expected, increasing, shape (n,) [s].
        away: where the points lie from their expected places, shape (n, d) [m].
    """
    count = len(times)
    if count < FEWEST_AFTER:
        return None
    covariance = PLACE_STD**2 + SPEED_STD**2 * np.outer(times, times)
    covariance[np.diag_indices(count)] += REFERENCE_NOISE**2
    before = np.concatenate([[0.0], times])[: count + 1 - FEWEST_AFTER]
    steps = np.diff(np.concatenate([[0.0], times]))[: count + 1 - FEWEST_AFTER]
    starts = (before[:, None] + steps[:, None] * np.arange(INSTANTS) / INSTANTS).ravel()
    ramps = np.maximum(times[:, None] - starts, 0.0)
    jumps = np.tril(np.ones((count, count)))
    shapes = np.hstack([ramps, jumps])
    weighted = np.linalg.solve(covariance, shapes)
    information = np.sum(shapes * weighted, axis=0)
    sizes = weighted.T @ away / information[:, None]
    evidence = np.sum(sizes**2, axis=1) * information
    best = int(np.argmax(evidence[: len(starts)]))
    after = count - best // INSTANTS
    tail = away[-after:]
    rest = tail - np.outer(ramps[-after:, best], sizes[best])
    misfit = float(np.sum(rest**2) / max(np.sum(tail**2), np.finfo(float).tiny))
    found = float(evidence[best])
    return Bounce(after, sizes[best], found, found - float(np.max(evidence[len(starts) :])), misfit)
