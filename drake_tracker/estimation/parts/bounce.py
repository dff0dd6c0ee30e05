"""A test for a bounce: a sudden change of the velocity, from the motion that was expected a few points ago.

From a bounce on, the offsets of the points from their expected places grow steadily in one direction, from zero at an
instant between two images. After a jump they stay as they are, and an outlier is a jump of the newest point alone. As
in `drake_tracker.estimation.parts.speed_change`, each instant is tried with its most likely size.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.estimation.parts.speed_change import PLACE_STD, REFERENCE_NOISE, SPEED_STD

INSTANTS = 4
"""Number of instants between two points at which a bounce is tried."""
FEWEST_AFTER = 2
"""Number of points after a bounce that are needed to tell it from an outlier."""
LARGEST_MISFIT = 0.15
"""Largest share of the squared offsets after a bounce that the bounce does not explain."""

TIME_DIGITS = 6
"""Decimal places of the times that are told apart [s]."""


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
    if len(times) < FEWEST_AFTER:
        return None
    ramps, solved, information = _shapes(tuple(round(time, TIME_DIGITS) for time in times.tolist()))
    sizes = solved @ away
    evidence = np.einsum("ij,ij->i", sizes, sizes) * information
    tried = ramps.shape[1]
    best = int(evidence[:tried].argmax())
    after = len(times) - best // INSTANTS
    tail = away[-after:]
    rest = tail - np.outer(ramps[-after:, best], sizes[best])
    misfit = float(np.vdot(rest, rest) / max(np.vdot(tail, tail), np.finfo(float).tiny))
    found = float(evidence[best])
    return Bounce(after, sizes[best], found, found - float(evidence[tried:].max()), misfit)


@lru_cache(maxsize=256)
def _shapes(times: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns what depends on the times only, read-only: (offsets after a bounce of unit size at each instant that is
    tried, shape (n, m); what gives the most likely sizes of these bounces, and of jumps at each point, from offsets,
    shape (m + n, n); the information about each size, shape (m + n,)).

    Images come at even times, so that these few matrices are mostly known.
    """
    count = len(times)
    at = np.array(times)
    covariance = PLACE_STD**2 + SPEED_STD**2 * np.outer(at, at)
    covariance[np.diag_indices(count)] += REFERENCE_NOISE**2
    before = np.concatenate([[0.0], at])[: count + 1 - FEWEST_AFTER]
    steps = np.diff(np.concatenate([[0.0], at]))[: count + 1 - FEWEST_AFTER]
    starts = (before[:, None] + steps[:, None] * np.arange(INSTANTS) / INSTANTS).ravel()
    ramps = np.maximum(at[:, None] - starts, 0.0)
    shapes = np.hstack([ramps, np.tril(np.ones((count, count)))])
    weighted = np.linalg.solve(covariance, shapes)
    information = np.sum(shapes * weighted, axis=0)
    return read_only(ramps), read_only(weighted.T / information[:, None]), read_only(information)
