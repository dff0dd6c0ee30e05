"""From contributions to blame: how much more a stage contributed than it does in a healthy run."""

import numpy as np

from drake_tracker.report.autopsy.normal import NORMAL_ATTEMPT, NORMAL_TRACKING
from drake_tracker.report.autopsy.stages import Stage

YAW_ARM = 0.05
"""Distance [m] from the middle at which a turn of the hand counts as an offset: half the train's length that is
gripped."""


def sizes(rows):
    """Returns the lengths [m] of contributions (..., 4): along, across, up, and what the turn moves at `YAW_ARM`."""
    return np.sqrt(np.sum((rows * [1.0, 1.0, 1.0, YAW_ARM]) ** 2, axis=-1))


def usual_sizes(rows):
    """Returns the lengths (7,) [m] within which 68 of 100 of the contributions (n, 7, 4) are; of unknown ones none, 0.

    Of errors that spread evenly that is their root mean square, and a single jump, as when a lap closes, changes
    nothing.
    """
    found = [column[np.isfinite(column)] for column in sizes(rows).T]
    return np.array([np.quantile(column, 0.68) if len(column) else 0.0 for column in found])


def excess(size, normal):
    """Returns by how much a length [m] is more than normal: the root of the difference of the squares."""
    return np.sqrt(np.maximum(np.square(size) - np.square(normal), 0.0))


def attempt_excess(rows):
    """Returns the excess (7,) [m] of an attempt's contributions (7, 4)."""
    return excess(sizes(rows), np.array(NORMAL_ATTEMPT))


def tracking_excess(rows):
    """Returns the excess (7,) [m] of the contributions (n, 7, 4) over the time of tracking."""
    return excess(usual_sizes(rows), np.array(NORMAL_TRACKING))


def run_excess(attempts, tracking):
    """Returns the excess (7,) [m] by which each stage is judged over a whole run.

    The larger of two: over the time of tracking, and the median over the attempts. One that hardly saw the train
    disturbed is worth as much as another.

    Args:
      attempts: contributions (7, 4) of those attempts that failed. tracking: contributions (n, 7, 4).
    """
    found = tracking_excess(tracking) if len(tracking) else np.zeros(len(Stage))
    if len(attempts):
        found = np.maximum(found, np.median([attempt_excess(rows) for rows in attempts], axis=0))
    return found
