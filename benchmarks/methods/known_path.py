"""An estimator that knows the path: the bound of what any estimator allows the arm to do."""

from typing import NamedTuple

import numpy as np

STEP, MEMORY = 0.001, 0.5
"""Distance of the places that are tried [m], and for how long points are remembered [s]."""


class Seen(NamedTuple):
    """State of `KnownPath`: time and position of the points remembered, shape (n, 4) [s, m]."""

    stamp: float
    rows: np.ndarray = np.empty((0, 4))


class KnownPath:
    """An `Estimator` that knows path and speed. Its points only say where the object was, and its direction.

    It shows what the arm could do at a lag if nothing about the path had to be estimated.

    Args:
        csv: file of the path.
        speed: of the object along the path [m/s].
    """

    def __init__(self, csv, speed):
        points = np.loadtxt(csv, delimiter=",", skiprows=1)
        places = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        self.places = np.arange(0.0, places[-1], STEP)
        self.points = np.column_stack([np.interp(self.places, places, column) for column in points.T])
        self.yaws = np.unwrap(np.arctan2(*np.gradient(self.points, axis=0).T[::-1]))
        self.speed = speed

    def initial_state(self):
        return Seen(-np.inf)

    def update(self, state, stamp, p_WQ):
        if p_WQ is None:
            return state
        rows = np.vstack([state.rows, [stamp, *p_WQ]])
        return Seen(stamp, rows[rows[:, 0] > stamp - MEMORY])

    def ready(self, state):
        return len(state.rows) > 0 and state.stamp - state.rows[0, 0] > 0.5 * MEMORY

    def predict(self, state, times):
        best = np.inf
        for speed in (self.speed, -self.speed):
            ago = np.rint(speed * (state.stamp - state.rows[:, 0]) / STEP).astype(int)
            then = np.clip(np.arange(len(self.places))[:, None] - ago, 0, len(self.places) - 1)
            errors = np.sum((self.points[then] - state.rows[:, 1:3]) ** 2, axis=(1, 2))
            if errors.min() < best:
                best = errors.min()
                places = self.places[np.argmin(errors)] + speed * (np.asarray(times) - state.stamp)
                turned = 0.0 if speed > 0.0 else np.pi
        x, y, yaw = (np.interp(places, self.places, column) for column in (*self.points.T, self.yaws))
        return np.column_stack([x, y, np.full(len(x), state.rows[-1, 3]), yaw + turned])

    def predict_std(self, state, times):
        return np.full(len(times), 0.001)
