"""From contributions to blame: by how much the contribution of a stage exceeds that in a healthy run."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.report.failure_diagnosis.normal import NORMAL_ATTEMPT, NORMAL_TRACKING
from drake_tracker.report.failure_diagnosis.stages import Stage

YAW_ARM = 0.05
"""Distance [m] from the middle at which a yaw of the hand counts as an offset: half the gripped length of the train."""


def sizes(rows: np.ndarray) -> np.ndarray:
    """Returns the lengths of contributions, shape (...) [m]; yaw counts as the displacement at `YAW_ARM`.

    Args:
        rows: along, across, up [m], yaw [rad], shape (..., 4).
    """
    return np.sqrt(np.sum((rows * [1.0, 1.0, 1.0, YAW_ARM]) ** 2, axis=-1))


def usual_sizes(rows: np.ndarray) -> np.ndarray:
    """Returns the 68th percentiles of the lengths of contributions, shape (7,) [m]; 0 where all are unknown.

    For normally distributed errors the percentile is about their root mean square, and it is insensitive to a single
    jump, as when a lap closes.

    Args:
        rows: shape (n, 7, 4), NaN where unknown.
    """
    found = [column[np.isfinite(column)] for column in sizes(rows).T]
    return np.array([np.quantile(column, 0.68) if len(column) else 0.0 for column in found])


def excess(size: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Returns the excess of a length over the normal one [m]: the root of the difference of their squares, or 0."""
    return np.sqrt(np.maximum(np.square(size) - np.square(normal), 0.0))


def attempt_excess(rows: np.ndarray) -> np.ndarray:
    """Returns the excess (7,) [m] of an attempt's contributions (7, 4)."""
    return excess(sizes(rows), np.array(NORMAL_ATTEMPT))


def tracking_excess(rows: np.ndarray) -> np.ndarray:
    """Returns the excess (7,) [m] of the contributions (n, 7, 4) while tracking."""
    return excess(usual_sizes(rows), np.array(NORMAL_TRACKING))


def run_excess(attempts: Sequence[np.ndarray], tracking: np.ndarray) -> np.ndarray:
    """Returns the excess (7,) [m] by which each stage is judged over a whole run.

    It is the larger of two: the excess while tracking, and the median excess over the failed attempts. The median keeps
    one unusual attempt from deciding.

    Args:
        attempts: contributions (7, 4) of each failed attempt.
        tracking: contributions while tracking, shape (n, 7, 4).
    """
    found = tracking_excess(tracking) if len(tracking) else np.zeros(len(Stage))
    if len(attempts):
        found = np.maximum(found, np.median([attempt_excess(rows) for rows in attempts], axis=0))
    return found
