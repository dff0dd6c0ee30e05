"""The model of the coordinated turn: an object that drives along an arc, seen as points.

A mean is a state (5,), a covariance (5, 5), in the order `X` ... `BEND`.
"""

import math

import numpy as np

X, Y, HEADING, SPEED, BEND = range(5)
"""Elements of the state: p_WQ [m], heading [rad], speed [m/s] along it, curvature [1/m], positive to the left."""
_SMALL_ANGLE = 1e-6


def propagate(mean, covariance, dt, q_speed, q_bend):
    """Returns mean and covariance ``dt`` [s] later; any dt >= 0 in one step.

    ``q_speed`` [m^2/s^3] and ``q_bend`` [1/m^2/s]: by how much the variances of speed and curvature grow in a second.
    """
    later, jacobian = turn_step(mean, dt)
    covariance = jacobian @ covariance @ jacobian.T
    _, _, heading, speed, _ = later.tolist()
    # Wandering speed moves the object along its path, wandering curvature across it.
    c, s = math.cos(heading), math.sin(heading)
    along, across = q_speed * dt**3 / 3.0, speed**4 * q_bend * dt**5 / 20.0
    xx, xy, yy = c * c * along + s * s * across, c * s * (along - across), s * s * along + c * c * across
    swing, swing_bend = speed**2 * q_bend * dt**3 / 3.0, speed * q_bend * dt**2 / 2.0
    covariance += np.array([
        [xx, xy, 0.0, 0.0, 0.0],
        [xy, yy, 0.0, 0.0, 0.0],
        [0.0, 0.0, swing, 0.0, swing_bend],
        [0.0, 0.0, 0.0, q_speed * dt, 0.0],
        [0.0, 0.0, swing_bend, 0.0, q_bend * dt],
    ])  # fmt: skip
    return later, covariance


def turn_step(mean, dt):
    """Returns the state ``dt`` [s] later without noise, and the Jacobian of that, shape (5, 5)."""
    x, y, heading, speed, bend = mean.tolist()
    way = speed * dt
    half = 0.5 * bend * way  # of the angle turned: the chord's direction is the heading plus this
    if abs(half) > _SMALL_ANGLE:
        shape, slope = math.sin(half) / half, (math.cos(half) - math.sin(half) / half) / half
    else:
        shape, slope = 1.0 - half * half / 6.0, -half / 3.0
    c, s = math.cos(heading + half), math.sin(heading + half)
    chord = way * shape
    later = np.array([x + chord * c, y + chord * s, heading + 2.0 * half, speed, bend])
    # How far the way and half the angle grow with the speed and with the curvature, and by them the chord.
    half_by_speed, half_by_bend = 0.5 * bend * dt, 0.5 * way
    by_speed, by_bend = shape * dt + way * slope * half_by_speed, way * slope * half_by_bend
    swing_by_speed, swing_by_bend = chord * half_by_speed, chord * half_by_bend
    jacobian = np.array([
        [1.0, 0.0, -chord * s, by_speed * c - swing_by_speed * s, by_bend * c - swing_by_bend * s],
        [0.0, 1.0, chord * c, by_speed * s + swing_by_speed * c, by_bend * s + swing_by_bend * c],
        [0.0, 0.0, 1.0, 2.0 * half_by_speed, 2.0 * half_by_bend],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0],
    ])  # fmt: skip
    return later, jacobian


def ahead(mean, covariance, x, y, variance):
    """Returns how far a point (x, y) [m] with noise ``variance`` per axis [m^2] lies ahead of the expected place, along
    the heading, in standard deviations."""
    x_expected, y_expected, heading, _, _ = mean.tolist()
    (a, b), (_, d) = covariance[:2, :2].tolist()
    c, s = math.cos(heading), math.sin(heading)
    along = c * (x - x_expected) + s * (y - y_expected)
    return along / math.sqrt(max(c * c * a + 2.0 * c * s * b + s * s * d, 0.0) + variance)


def correct(mean, covariance, point, variance):
    """Kalman correction by a point (2,) [m] with noise ``variance`` per axis [m^2].

    Returns (mean, covariance, residual left (2,) [m], the trace of the corrected covariance of the place [m^2]).
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


def height_step(mean, covariance, z, dt, q_climb, variance):
    """Returns z and climb (2,) [m, m/s], and their covariance, ``dt`` [s] later and corrected by a measured ``z`` [m].

    ``q_climb``: by how much the variance of the climb grows in a second [m^2/s^3]. ``variance``: of the noise of z
    [m^2]; infinite where nothing was measured.
    """
    (a, b), (_, d) = covariance.tolist()
    a, b, d = a + dt * (2.0 * b + dt * d) + q_climb * dt**3 / 3.0, b + dt * d + q_climb * dt**2 / 2.0, d + q_climb * dt
    height, climb = mean.tolist()
    height += dt * climb
    gain, climb_gain = a / (a + variance), b / (a + variance)
    residual = z - height
    covariance = np.array([[(1.0 - gain) * a, (1.0 - gain) * b], [(1.0 - gain) * b, d - climb_gain * b]])
    return np.array([height + gain * residual, climb + climb_gain * residual]), covariance


def turned_about(mean, covariance):
    """Returns mean and covariance of the same motion with the object's front at its other end."""
    sign = np.array([1.0, 1.0, 1.0, -1.0, -1.0])
    return mean * sign + np.array([0.0, 0.0, math.pi, 0.0, 0.0]), covariance * np.outer(sign, sign)


def near_a_line(rows, reach):
    """Returns which rows (stamp, x, y, z) lie near a line through most of them, driven at constant speed, shape (n,).

    Near is within ``reach`` [m]: of the line of least squares, if all are; else of one that up to half of the points
    cannot move (Siegel's repeated medians), where a path that bends is granted six times the median distance as well.
    """
    age, places = rows[:, 0] - rows[-1, 0], rows[:, 1:3]

    def distances(lines):
        return np.hypot(*(places - np.outer(age, lines[0]) - lines[1]).T)

    if np.all(distances(np.polyfit(age, places, 1)) <= reach):
        return np.full(len(rows), True)
    from scipy.stats import siegelslopes  # takes a second to load, and is seldom wanted

    away = distances(np.transpose([siegelslopes(axis, age, method="separate") for axis in places.T]))
    return away <= np.maximum(reach, 6.0 * np.median(away))
