"""Fuses measurements of one point by several sensors."""

from collections.abc import Sequence

import numpy as np


def fuse(measurements: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the most likely point and its covariance, for independent errors: the information filter.

    Args:
        measurements: (point of shape (n,), covariance (n, n)) of each sensor, one or more.

    Returns (point of shape (n,), covariance (n, n)).
    """
    if len(measurements) == 1:
        return measurements[0]
    information = [np.linalg.inv(covariance) for _, covariance in measurements]
    covariance = np.linalg.inv(np.sum(information, axis=0))
    point = covariance @ np.sum([each @ point for each, (point, _) in zip(information, measurements)], axis=0)
    return point, 0.5 * (covariance + covariance.T)
