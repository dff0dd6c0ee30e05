"""A small model of a ball on a board with pegs, for the tests of the slope estimator: circles that bounce and slip."""

import numpy as np

WIDTH, LENGTH, RADIUS, PEG_RADIUS, INCLINE = 0.60, 0.90, 0.020, 0.006, np.deg2rad(10.0)
PERIOD, LAG = 4.0 / 60.0, 0.1
"""Time between points, and from a point's stamp until it is known [s] (Nashman and Chaconas 1990: 66.8, 100.2 ms)."""
STEP = 0.001
GRAVITY = 9.81


def board_pose(yaw=0.02, edge=(0.55, 0.003, 0.50)):
    """X_WB (4, 4): y_B up the slope, away from the robot."""
    c, s, ci, si = np.cos(yaw), np.sin(yaw), np.cos(INCLINE), np.sin(INCLINE)
    up, across = np.array([c * ci, s * ci, si]), np.array([s, -c, 0.0])
    X = np.eye(4)
    X[:3, 0], X[:3, 1], X[:3, 2], X[:3, 3] = across, up, np.cross(across, up), edge
    return X


def to_world(points, X_WB):
    """Rows x, y [m, B] of ball centres as p_WQ."""
    points = np.asarray(points)
    return X_WB[:3, 3] + np.column_stack([points, np.full(len(points), RADIUS)]) @ X_WB[:3, :3].T


def draw_pegs(rng):
    """12 to 14 places of pegs, so far from each other and from the walls that a ball gets through."""
    pegs, count = [], rng.integers(12, 15)
    while len(pegs) < count:
        p = rng.uniform([-0.235, 0.20], [0.235, 0.72])
        if all(np.hypot(*(p - q)) > 0.065 for q in pegs):
            pegs.append(p)
    return np.array(pegs)


def roll(count, seed=0, pegs=True, restitution=0.6, friction=0.3, start_speed=0.0, duration=6.0):
    """Rolls ``count`` balls, each on a board of its own.

    Returns (paths (n, count, 2) [m, B] every `STEP`, crossing times (count,) [s], nan where it never came down, and
    times of the last hit of a peg or a wall (count,)). A hit leaves the spin as it was: the ball slips until it rolls.
    """
    rng = np.random.default_rng([seed, 1])
    p = np.column_stack([rng.uniform(-0.22, 0.22, count), np.full(count, 0.84)])
    v = np.column_stack([rng.uniform(-start_speed, start_speed, count), np.zeros(count)])
    u = v.copy()  # speed of the ball's surface by its spin
    places = [draw_pegs(rng) if pegs else np.full((1, 2), 9.0) for _ in range(count)]
    most = max(map(len, places))
    pegs = np.array([np.vstack([q, np.full((most - len(q), 2), 9.0)]) for q in places])
    pull = np.array([0.0, -GRAVITY * np.sin(INCLINE)])
    grip = friction * GRAVITY * np.cos(INCLINE)
    half, near = WIDTH / 2 - RADIUS, RADIUS + PEG_RADIUS
    paths, hits = [p.copy()], np.zeros(count)
    for k in range(round(duration / STEP)):
        slip = v - u
        rub = grip * slip / np.maximum(np.hypot(*slip.T), 0.02)[:, None]
        on_board = (p[:, 1] > 0.0)[:, None]
        v = v + STEP * np.where(on_board, pull - rub, 0.0)
        u = u + STEP * 1.5 * np.where(on_board, rub, 0.0)
        p = p + STEP * v
        gap = p[:, None, :] - pegs
        distance = np.hypot(gap[..., 0], gap[..., 1])
        first = np.argmin(distance, axis=1)
        rows = np.arange(count)
        normal = gap[rows, first] / distance[rows, first][:, None]
        closing = np.einsum("ij,ij->i", v, normal)
        touch = distance[rows, first] < near
        v = v - np.where(touch & (closing < 0.0), (1.0 + restitution) * closing, 0.0)[:, None] * normal
        p = p + np.where(touch, near - distance[rows, first], 0.0)[:, None] * normal
        out = (abs(p[:, 0]) > half) & (p[:, 0] * v[:, 0] > 0.0) & (p[:, 1] > 0.0)
        v[out, 0] *= -0.5
        hits[(touch | out) & (p[:, 1] > 0.0)] = (k + 1) * STEP
        paths.append(p.copy())
        if np.all(p[:, 1] <= 0.0):
            break
    paths = np.array(paths)
    gone = paths[:, :, 1] <= 0.0
    times = np.where(gone.any(axis=0), np.argmax(gone, axis=0) * STEP, np.nan)
    return paths, times, hits


def points_of(path, until, rng, sigma=0.0025, phase=0.0):
    """Stamps and noisy points (n, 2) [m, B] of one path up to ``until`` [s]."""
    stamps = np.arange(0.05 + phase * PERIOD, until, PERIOD)
    return stamps, path[np.rint(stamps / STEP).astype(int)] + sigma * rng.standard_normal((len(stamps), 2))
