"""A test for a sudden change of speed, from the motion that was expected a few points ago.

The offsets of the newest points along the expected path are explained in three ways: by noise alone; by a change of the
speed, after which the offset grows steadily; or by a jump, after which it stays. Time and size of a change are unknown,
so each time is tried with its most likely size: a generalised likelihood ratio test (Willsky and Jones 1976). An
outlier is a jump at the newest point.
"""

from typing import NamedTuple

import numpy as np

REFERENCE_NOISE = 0.001
"""Noise of a point that the test assumes [m]. The true noise only scales its statistic."""
PLACE_STD = 0.001
"""Standard deviation of the expected place of the object while the noise is that [m]."""
SPEED_STD = 0.010
"""Standard deviation of its expected speed while the noise is that [m/s]."""
FEWEST_AFTER = 3
"""Number of points after a change that are needed to tell it from a jump."""


class SpeedChange(NamedTuple):
    """The most likely change of speed.

    Attributes:
        last: index of the last point before the change.
        gain: change of the speed [m/s].
        evidence: twice the logarithm of the likelihood ratio of the change and no change, for `REFERENCE_NOISE`.
        margin: the same of the change and the most likely jump.
    """

    last: int
    gain: float
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
    after = np.maximum(times[:, None] - times[: count - 1], 0.0)
    shapes = np.hstack([after[:, : count - FEWEST_AFTER], np.sign(after)])
    weighted = np.linalg.solve(covariance, shapes)
    information = np.sum(shapes * weighted, axis=0)
    sizes = (along @ weighted) / information
    evidence = sizes**2 * information
    changes, jumps = evidence[: count - FEWEST_AFTER], evidence[count - FEWEST_AFTER :]
    last = int(np.argmax(changes))
    best = float(changes[last])
    return SpeedChange(last, float(sizes[last]), best, best - float(np.max(jumps)))
