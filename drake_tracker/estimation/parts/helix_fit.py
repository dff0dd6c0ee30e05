"""The fit of a `Helix` to points in space: bending and torsion from noisy chords (docs/explanation/frenet.md).

If R rotates an earlier chord e into the later chord l, then l - e = q x m with m = (e + l) / 2 and q = 2 tan(angle / 2)
along the axis of R. The least-squares solution over all pairs is M q = mean(e x l), with M = mean(|m|^2 - m m^T). Noise
leaves the mean of e x l as it is and adds the variance of a point to each eigenvalue of M, so that it is taken away.
"""

import math

import numpy as np

from drake_tracker.estimation.parts.helix import displacement, rotated

PRIOR_TORSION = 1.0
"""Standard deviation of the torsion of a path that is assumed before the points are seen [1/m]; chosen on development
seeds."""

LEAST_FACTOR = 0.2
"""Of chords that turn further than a window, the mean across the axis is not restored below this length; chosen."""


def _tan_factor(angle: float) -> float:
    """Returns 2 tan(angle / 2) / angle."""
    return 1.0 if angle < 1e-6 else 2.0 * math.tan(0.5 * angle) / angle


def _rotation(q: np.ndarray) -> np.ndarray:
    """Returns the rotation vector [rad] of q."""
    size = float(np.linalg.norm(q))
    return q * (2.0 * math.atan(0.5 * size) / size if size > 1e-12 else 1.0)


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Returns the solution of a symmetric system, zero in directions that points without a path leave open."""
    return np.linalg.pinv(matrix, rcond=1e-9, hermitian=True) @ right


def _tangent(middle: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Returns the direction of the path, shape (3,), where the middle m of two chords lies."""
    angle = math.sqrt(float(turn @ turn))
    along = turn * float(turn @ middle) / max(angle, 1e-9) ** 2
    tangent = along + (angle / max(math.sin(angle), 1e-3) if angle > 1e-9 else 1.0) * (middle - along)
    return tangent / max(float(np.linalg.norm(tangent)), 1e-12)


def fit_torsion(points: np.ndarray, m: int, weights: np.ndarray, variance: float, length: float) -> float:
    """Returns the torsion [rad] over one baseline: the part of the rotation vector along the path.

    The shorter the baseline and the straighter the path, the more noise it has. This noise is computed, and a torsion
    that is less certain than `PRIOR_TORSION` is reduced as in a Kalman filter.

    Args:
        points: one per frame, the newest first, shape (n, 3), in W [m].
        m: baseline [frames].
        weights: weight of each pair of chords, the newest first, shape (k,) with k + 2 m <= n.
        variance: of the noise of a point, per axis [m^2].
        length: length of a chord without noise [m].
    """
    count = len(weights)
    later, earlier = (points[k : k + count] - points[k + m : k + m + count] for k in (0, m))
    middle, cross = 0.5 * (later + earlier), weights @ np.cross(earlier, later)
    outer = (weights[:, None] * middle).T @ middle
    matrix = (np.trace(outer) - variance) * np.eye(3) - outer
    mean = weights @ middle
    axis = mean / max(float(np.linalg.norm(mean)), 1e-12)
    lever = weights[:, None] * (middle - np.outer(middle @ axis, axis))
    on_points = np.zeros((count + 2 * m, 3))  # each point belongs to three pairs
    for shift, factor in ((0, 1.0), (m, -2.0), (2 * m, 1.0)):
        on_points[shift : shift + count] += factor * lever
    noise = variance * float(np.sum(on_points**2))
    observed = max(float(axis @ matrix @ axis), 1e-6 * length**2)
    ridge = noise / (observed * (PRIOR_TORSION * length) ** 2) + 1e-9 * length**2
    turn = _rotation(_solved(matrix + ridge * np.outer(axis, axis), cross))
    now = unsmoothed(mean, turn, weights, (np.arange(count) - 0.5 * (count - 1)) / m)
    return float(turn @ _tangent(now, turn))


def fit_turn(chords: np.ndarray, m: int, weights: np.ndarray, variance: float, torsion: float) -> np.ndarray:
    """Returns the rotation vector from a chord to the next one, shape (3,), in W [rad].

    Bending is the mean of the smallest rotations between the directions of two chords, as in the plane: then the noise
    of a point that belongs to several pairs nearly cancels. The smallest rotation is the part of the rotation vector
    across the chord.

    Args:
        chords: the chords of ``m`` frames, one per frame, the newest first, shape (n, 3), in W [m].
        m: baseline [frames].
        weights: weight of each pair, the newest first, shape (k,) with k + m <= n.
        variance: of the noise of a point, per axis [m^2].
        torsion: part of the rotation vector along the path [rad].
    """
    later, earlier = chords[: len(weights)], chords[m : m + len(weights)]
    cross, middle = np.cross(earlier, later), 0.5 * (later + earlier)
    sine, squares = np.linalg.norm(cross, axis=1), np.sum(middle**2, axis=1)
    angles = np.arctan2(sine, np.sum(earlier * later, axis=1))
    smallest = weights @ (cross * (angles / np.maximum(sine, 1e-300))[:, None])
    directions = middle / np.sqrt(np.maximum(squares, 1e-300))[:, None]
    shaken = 0.5 * variance / max(float(weights @ squares) - 1.5 * variance, 1e-300)  # of a direction, per axis [rad^2]
    matrix = (1.0 + shaken) * np.eye(3) - (weights[:, None] * directions).T @ directions
    mean, ages = weights @ directions, (np.arange(len(weights)) - 0.5 * (len(weights) - 1)) / m
    turn = np.zeros(3)
    for _ in range(5):  # the path in the middle follows from the rotation, and the rotation from this path
        axis = _tangent(unsmoothed(mean, turn, weights, ages), turn)
        across = np.eye(3) - np.outer(axis, axis)
        along = torsion * _tan_factor(float(np.linalg.norm(turn))) * axis
        bending = float(np.linalg.norm(turn - axis * float(axis @ turn)))
        right = across @ (_tan_factor(bending) * smallest - matrix @ along)
        turn = _rotation(across @ _solved(across @ matrix @ across + np.outer(axis, axis), right) + along)
    return turn


def unsmoothed(mean: np.ndarray, turn: np.ndarray, weights: np.ndarray, ages: np.ndarray) -> np.ndarray:
    """Returns the chord of age zero from a weighted mean of chords, shape (3,).

    The mean of chords that turn is shorter across the axis, and rotated if the ages are not symmetric about zero.

    Args:
        mean: the mean, shape (3,).
        turn: rotation vector per unit of age, shape (3,) [rad].
        weights: weight of each chord, shape (n,).
        ages: how much older than age zero each chord is, shape (n,).
    """
    angle = math.sqrt(float(turn @ turn))
    factor = complex(weights @ np.exp(-1j * angle * ages))
    forward = rotated(mean, turn, [-math.atan2(factor.imag, factor.real) / angle if angle > 1e-9 else 0.0])[0]
    along = turn * float(turn @ mean) / max(angle, 1e-9) ** 2
    return along + (forward - along) / max(abs(factor), LEAST_FACTOR)


def mean_offset(chord: np.ndarray, turn: np.ndarray, weights: np.ndarray, ages: np.ndarray) -> np.ndarray:
    """Returns the vector from the point of age zero to a weighted mean of points, shape (3,) [m].

    Args:
        chord: the chord that ends at age zero, shape (3,) [m].
        turn: rotation vector per baseline, shape (3,) [rad].
        weights: weight of each point, shape (n,).
        ages: age of each point, shape (n,) [baselines].
    """
    return weights @ displacement(chord, turn, -ages)
