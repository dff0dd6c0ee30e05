"""The coordinated-turn model: an object that moves along an arc, seen as points.

A mean is a state (5,) and a covariance is (5, 5), in the order `X` ... `CURVATURE`.
"""

import math

import numpy as np

X, Y, HEADING, SPEED, CURVATURE = range(5)
"""Elements of the state: p_WQ [m], heading [rad], speed along it [m/s], curvature [1/m], positive to the left."""
SIGMA_LIMITS = (1e-4, 0.02)
"""Smallest and largest estimate of the noise of a point [m]."""
_SIGMA_TIME = 1.0
"""Time constant of that estimate [s]."""
_SMALL_ANGLE = 1e-6
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_SPREAD = 0.5 * (_NODES + 1.0)
_SPREAD_CUBED, _SPREAD_WEIGHTS = _SPREAD**3, 0.5 * _WEIGHTS * 3.0 * _SPREAD**2
"""Of the integral in `fading_turn`. Nodes crowd at the beginning, where the heading changes: distances are cubes of
evenly spread numbers."""
START_POINTS = 8
"""Points through which the first straight line is fitted."""
Row = tuple[float, float, float, float]
"""A point: capture time [s], x, y, z in W [m]."""


def propagate(
    mean: np.ndarray, covariance: np.ndarray, dt: float, q_speed: float, q_curvature: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean and covariance after a time of any length, in one step.

    Args:
        mean: shape (5,).
        covariance: shape (5, 5).
        dt: the time, zero or more [s].
        q_speed: growth of the variance of the speed per second [m^2/s^3].
        q_curvature: growth of the variance of the curvature per second [1/m^2/s].
    """
    later, jacobian = turn_step(mean, dt)
    covariance = jacobian @ covariance @ jacobian.T
    _, _, heading, speed, _ = later.tolist()
    xx, xy, yy = _position_noise(heading, speed, dt, q_speed, q_curvature)
    turn, turn_curvature = speed**2 * q_curvature * dt**3 / 3.0, speed * q_curvature * dt**2 / 2.0
    covariance += np.array([
        [xx, xy, 0.0, 0.0, 0.0],
        [xy, yy, 0.0, 0.0, 0.0],
        [0.0, 0.0, turn, 0.0, turn_curvature],
        [0.0, 0.0, 0.0, q_speed * dt, 0.0],
        [0.0, 0.0, turn_curvature, 0.0, q_curvature * dt],
    ])  # fmt: skip
    return later, covariance


def position_variances(
    mean: np.ndarray, covariance: np.ndarray, times: list[float], q_speed: float, q_curvature: float
) -> np.ndarray:
    """Returns the sum of the variances of x and y after each of some times, shape (n,) [m^2], as `propagate` has them.

    Args:
        mean: shape (5,).
        covariance: shape (5, 5).
        times: zero or more [s].
        q_speed: see `propagate`.
        q_curvature: see there.
    """
    steps = [_turn_step(mean.tolist(), dt) for dt in times]
    jacobians = np.array([jacobian for _, jacobian in steps])
    spreads = jacobians @ covariance @ jacobians.transpose(0, 2, 1)
    sums = []
    for dt, ((_, _, heading, speed, _), _), spread in zip(times, steps, spreads):
        xx, _, yy = _position_noise(heading, speed, dt, q_speed, q_curvature)
        sums.append((spread[X, X] + xx) + (spread[Y, Y] + yy))
    return np.array(sums)


def _position_noise(
    heading: float, speed: float, dt: float, q_speed: float, q_curvature: float
) -> tuple[float, float, float]:
    """Returns the variances and the covariance of x and y that a time adds: (xx, xy, yy) [m^2]; see `propagate`."""
    # A random walk of the speed moves the object along its path, a random walk of the curvature across it.
    c, s = math.cos(heading), math.sin(heading)
    along, across = q_speed * dt**3 / 3.0, speed**4 * q_curvature * dt**5 / 20.0
    return c * c * along + s * s * across, c * s * (along - across), s * s * along + c * c * across


def turn_step(mean: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the state after a time without noise, shape (5,), and its Jacobian, shape (5, 5).

    Args:
        mean: the state before, shape (5,).
        dt: the time [s], which may be negative.
    """
    later, jacobian = _turn_step(mean.tolist(), dt)
    return np.array(later), np.array(jacobian)


def _turn_step(mean: list[float], dt: float) -> tuple[list[float], list[list[float]]]:
    """Returns the result of `turn_step` as lists."""
    x, y, heading, speed, curvature = mean
    distance = speed * dt
    half = 0.5 * curvature * distance  # half of the turn: the chord's direction is the heading plus this
    if abs(half) > _SMALL_ANGLE:
        shape, slope = math.sin(half) / half, (math.cos(half) - math.sin(half) / half) / half
    else:
        shape, slope = 1.0 - half * half / 6.0, -half / 3.0
    c, s = math.cos(heading + half), math.sin(heading + half)
    chord = distance * shape
    later = [x + chord * c, y + chord * s, heading + 2.0 * half, speed, curvature]
    # Derivatives of half the turn, of the chord's length and of its direction, by speed and by curvature.
    half_by_speed, half_by_curvature = 0.5 * curvature * dt, 0.5 * distance
    by_speed, by_curvature = shape * dt + distance * slope * half_by_speed, distance * slope * half_by_curvature
    turn_by_speed, turn_by_curvature = chord * half_by_speed, chord * half_by_curvature
    return later, [
        [1.0, 0.0, -chord * s, by_speed * c - turn_by_speed * s, by_curvature * c - turn_by_curvature * s],
        [0.0, 1.0, chord * c, by_speed * s + turn_by_speed * c, by_curvature * s + turn_by_curvature * c],
        [0.0, 0.0, 1.0, 2.0 * half_by_speed, 2.0 * half_by_curvature],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0],
    ]


def fading_turn(mean: np.ndarray, times: np.ndarray, length: float) -> np.ndarray:
    """Returns positions and headings of an object whose curvature fades, shape (n, 3): rows x, y [m], heading [rad].

    The curvature falls exponentially with the distance travelled. This is the expected curvature on a path whose bends
    end at random, after ``length`` on average. Exact to 1 um as long as the turn is less than half a circle.

    Args:
        mean: the state now, shape (5,).
        times: from now, shape (n,) [s].
        length: mean length of a bend [m].
    """
    x, y, heading, speed, curvature = mean.tolist()
    distance = speed * times
    turn, far = curvature * length * np.sign(distance), np.abs(distance)
    headings = heading - turn[:, None] * np.expm1(-np.outer(far, _SPREAD_CUBED) / length)
    rows = np.empty((len(times), 3))
    rows[:, 0] = x + distance * (np.cos(headings) @ _SPREAD_WEIGHTS)
    rows[:, 1] = y + distance * (np.sin(headings) @ _SPREAD_WEIGHTS)
    rows[:, 2] = heading - turn * np.expm1(-far / length)
    return rows


def normalized_lead(mean: np.ndarray, covariance: np.ndarray, x: float, y: float, variance: float) -> float:
    """Returns how far a point lies ahead of its expected position along the heading, in standard deviations.

    Args:
        mean: the expected state, shape (5,).
        covariance: its covariance, shape (5, 5).
        x: x of the point [m].
        y: y of the point [m].
        variance: of the point's noise, per axis [m^2].
    """
    x_expected, y_expected, heading, _, _ = mean.tolist()
    (a, b), (_, d) = covariance[:2, :2].tolist()
    c, s = math.cos(heading), math.sin(heading)
    along = c * (x - x_expected) + s * (y - y_expected)
    return along / math.sqrt(max(c * c * a + 2.0 * c * s * b + s * s * d, 0.0) + variance)


def correct(
    mean: np.ndarray, covariance: np.ndarray, point: np.ndarray, variance: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Kalman correction by a point.

    Args:
        mean: the expected state, shape (5,).
        covariance: its covariance, shape (5, 5).
        point: measured (x, y), shape (2,) [m].
        variance: of the point's noise, per axis [m^2].

    Returns:
        (mean, covariance, residual after the correction (2,) [m], trace of the corrected covariance of x and y [m^2]).
    """
    innovation = point - mean[:2]
    (a, b), (_, d) = covariance[:2, :2].tolist()
    a, d = a + variance, d + variance
    determinant = a * d - b * b
    inverse = np.array([[d / determinant, -b / determinant], [-b / determinant, a / determinant]])
    gain = covariance[:, :2] @ inverse
    mean = mean + gain @ innovation
    covariance = covariance - gain @ covariance[:2]
    covariance = 0.5 * (covariance + covariance.T)
    return mean, covariance, point - mean[:2], covariance[X, X] + covariance[Y, Y]


def updated_sigma(sigma: float, residual: np.ndarray, trace: float, dt: float) -> float:
    """Returns the estimated noise of a point, per axis, after another point [m], within `SIGMA_LIMITS`.

    The residual after the correction, plus the part that the correction absorbed, is the noise (Mehra 1972).

    Args:
        sigma: the estimate before [m].
        residual: the return value of `correct`, shape (2,) [m].
        trace: what `correct` returned [m^2].
        dt: time since the previous point [s].
    """
    variance = sigma**2
    measured = 0.5 * (residual @ residual + trace)
    gain = 1.0 - math.exp(-dt / _SIGMA_TIME)
    updated = math.sqrt(variance + gain * (measured - variance))
    return min(max(updated, SIGMA_LIMITS[0]), SIGMA_LIMITS[1])


def height_step(
    mean: np.ndarray, covariance: np.ndarray, z: float, dt: float, q_climb: float, variance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns height and climb, (2,) [m, m/s], and their covariance (2, 2), after a time and a measurement.

    Args:
        mean: height and climb before, shape (2,).
        covariance: their covariance, shape (2, 2).
        z: measured height [m].
        dt: the time [s].
        q_climb: growth of the variance of the climb per second [m^2/s^3].
        variance: of the noise of ``z`` [m^2]; infinite: ``z`` is ignored.
    """
    (a, b), (_, d) = covariance.tolist()
    a, b, d = a + dt * (2.0 * b + dt * d) + q_climb * dt**3 / 3.0, b + dt * d + q_climb * dt**2 / 2.0, d + q_climb * dt
    height, climb = mean.tolist()
    height += dt * climb
    gain, climb_gain = a / (a + variance), b / (a + variance)
    residual = z - height
    covariance = np.array([[(1.0 - gain) * a, (1.0 - gain) * b], [(1.0 - gain) * b, d - climb_gain * b]])
    return np.array([height + gain * residual, climb + climb_gain * residual]), covariance


def turned_about(mean: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean and covariance of the same motion with front and rear of the object exchanged.

    Args:
        mean: shape (5,).
        covariance: shape (5, 5).
    """
    sign = np.array([1.0, 1.0, 1.0, -1.0, -1.0])
    return mean * sign + np.array([0.0, 0.0, math.pi, 0.0, 0.0]), covariance * np.outer(sign, sign)


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

    The line is the least-squares line if all points are near it. Otherwise the line is robust (Siegel's repeated
    medians): up to half of the points cannot move it. Its tolerance is at least six times the median distance, so that
    a curved path passes.

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
