"""The start of the coordinated-turn filter: a straight line through its first points."""

import math

import numpy as np

START_POINTS = 8
"""Points through which the first straight line is fitted."""
Row = tuple[float, float, float, float]
"""A point: capture time [s], x, y, z in W [m]."""


def first_estimate(rows: np.ndarray, sigma: float, heading: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean (5,) and covariance (5, 5) of the filter's state at the newest of the first points.

    Args:
        rows: the points (stamp [s], x, y, z [m]), oldest first, shape (n, 4). Fewer than `START_POINTS` give no speed.
        sigma: noise of a point, per axis [m].
        heading: the last known heading, used as long as there are too few points [rad].
    """
    if len(rows) < START_POINTS:
        return np.array([*rows[-1, 1:3], heading, 0.0, 0.0]), np.eye(5)
    return along_a_line(rows, sigma)


def along_a_line(rows: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean (5,) and covariance (5, 5) of the state at the newest of some points on a straight line.

    Args:
        rows: the points (stamp [s], x, y, z [m]), oldest first, shape (n, 4), at least two.
        sigma: noise of a point, per axis [m].
    """
    age = rows[:, 0] - rows[-1, 0]
    slope, at_end = np.polyfit(age, rows[:, 1:3], 1)
    spread = np.sum((age - age.mean()) ** 2)
    speed = math.hypot(*slope)
    rate_variance = sigma**2 / spread
    mean = np.array([*at_end, math.atan2(slope[1], slope[0]), speed, 0.0])
    position_variance = 4.0 * sigma**2 / len(rows)
    heading_variance = min(rate_variance / max(speed, 1e-3) ** 2, math.pi**2)
    return mean, np.diag([position_variance, position_variance, heading_variance, rate_variance, 25.0])


def near_a_line(rows: np.ndarray, tolerance: float) -> np.ndarray:
    """Returns which points lie near a straight line through most of them at constant speed, shape (n,), boolean.

    The line is the least-squares line if all points are near it. Otherwise it is a robust line (Siegel's repeated
    medians), which up to half of the points cannot move; there the tolerance is at least six times the median distance,
    so that a curved path passes.

    Args:
        rows: the points (stamp [s], x, y, z [m]), oldest first, shape (n, 4).
        tolerance: largest distance of a near point [m].
    """
    age, positions = rows[:, 0] - rows[-1, 0], rows[:, 1:3]

    def distances(lines: np.ndarray) -> np.ndarray:
        return np.hypot(*(positions - np.outer(age, lines[0]) - lines[1]).T)

    if np.all(distances(np.polyfit(age, positions, 1)) <= tolerance):
        return np.full(len(rows), True)
    from scipy.stats import siegelslopes  # imported here because it takes a second and is rarely needed

    away = distances(np.transpose([siegelslopes(axis, age, method="separate") for axis in positions.T]))
    return away <= np.maximum(tolerance, 6.0 * np.median(away))
