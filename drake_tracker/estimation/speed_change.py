"""A test for a sudden change of speed: did the object leave the motion that was expected a few points ago?

The offsets of the newest points along the expected path are explained in three ways: by noise alone, by a change of the
speed, after which the offset grows steadily, or by a jump, after which it stays. Time and size of the change are
unknown, so each time is tried with its most likely size: a generalised likelihood ratio test (Willsky and Jones 1976).
A drift takes a few points to show, because a filter that averages over many of them is replaced by one that does not.
"""

from typing import NamedTuple

import numpy as np

REFERENCE_NOISE = 0.001
"""Noise of a point that the test assumes [m]. The true noise only scales its statistic."""
PLACE_STD = 0.001
"""Standard deviation of the expected place of the object before the change, in units of the same noise [m]."""
SPEED_STD = 0.010
"""The same of its expected speed [m/s]."""
FEWEST_AFTER = 3
"""Number of points after a change that are needed to tell it from a jump or from outliers."""


class SpeedChange(NamedTuple):
    """The most likely change of speed.

    Attributes:
        last: index of the last point before the change.
        gain: change of the speed [m/s].
        std: its standard deviation if the noise is `REFERENCE_NOISE` [m/s].
        evidence: twice the logarithm of the likelihood ratio of the change and no change, for the same noise.
        margin: the same of the change and the most likely jump.
    """

    last: int
    gain: float
    std: float
    evidence: float
    margin: float


def most_likely_change(times: np.ndarray, along: np.ndarray) -> SpeedChange | None:
    """Returns the most likely change of speed, None if there are too few points.

    Args:
        times: times of the points after that of the state from which they were expected, increasing, shape (n,) [s].
        along: how far the points lie ahead of their expected places, shape (n,) [m].
    """
    count = len(times)
    if count <= FEWEST_AFTER:
        return None
    covariance = PLACE_STD**2 + SPEED_STD**2 * np.outer(times, times)
    covariance[np.diag_indices(count)] += REFERENCE_NOISE**2
    # A change after point k adds a ramp that begins there, a jump after point k a step.
    after = times[:, None] - times[None, : count - 1]
    ramps, steps = np.maximum(after, 0.0), (after > 0.0).astype(float)
    weighted = np.linalg.solve(covariance, np.column_stack([along, ramps, steps]))
    information = np.sum(np.column_stack([ramps, steps]) * weighted[:, 1:], axis=0)
    sizes = (along @ weighted[:, 1:]) / information
    evidence = sizes**2 * information
    kinks = evidence[: count - FEWEST_AFTER]
    last = int(np.argmax(kinks))
    best = float(kinks[last])
    margin = best - float(np.max(evidence[count - 1 :]))
    return SpeedChange(last, float(sizes[last]), float(information[last] ** -0.5), best, margin)
