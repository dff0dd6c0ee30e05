"""An estimator such as a user writes, and ways to get one wrong."""

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Newest:
    """The newest point and the one before."""

    stamp: float
    points: tuple = ()


class StraightOn:
    """Goes on as from the point before to the newest one."""

    def __init__(self, std=0.01):
        if not std > 0.0:
            raise ValueError(f"std is {std}")
        self.std = std

    def initial_state(self):
        return Newest(-np.inf)

    def update(self, state, stamp, p_WQ):
        return state if p_WQ is None else Newest(stamp, (*state.points[-1:], (stamp, p_WQ)))

    def ready(self, state):
        return len(state.points) == 2

    def predict(self, state, times):
        (t0, p0), (t1, p1) = state.points
        velocity = (p1 - p0) / (t1 - t0)
        rows = p1 + np.outer(np.asarray(times) - t1, velocity)
        return np.column_stack([rows, np.full(len(rows), np.arctan2(velocity[1], velocity[0]))])

    def predict_std(self, state, times):
        return np.full(len(times), self.std)


class ChangesItsState(StraightOn):
    def update(self, state, stamp, p_WQ):
        new = super().update(state, stamp, p_WQ)
        object.__setattr__(state, "points", new.points)
        return new


class ReturnsItsState(StraightOn):
    def update(self, state, stamp, p_WQ):
        if p_WQ is not None:
            object.__setattr__(state, "stamp", stamp)
        return state


class ForgetsTheTime(StraightOn):
    def update(self, state, stamp, p_WQ):
        return state if p_WQ is None else replace(super().update(state, stamp, p_WQ), stamp=0.0)


class CoastsWithoutPoints(StraightOn):
    def update(self, state, stamp, p_WQ):
        return replace(state, stamp=stamp) if p_WQ is None else super().update(state, stamp, p_WQ)


class WithoutYaw(StraightOn):
    def predict(self, state, times):
        return super().predict(state, times)[:, :3]


class OneDeviation(StraightOn):
    def predict_std(self, state, times):
        return self.std


class NotFinite(StraightOn):
    def predict(self, state, times):
        return np.nan * super().predict(state, times)


class Raises(StraightOn):
    def ready(self, state):
        return state.nothing


class ReturnsNone(StraightOn):
    def predict(self, state, times):
        return None


class Exits(StraightOn):
    def update(self, state, stamp, p_WQ):
        raise SystemExit(0)


class NegativeDeviation(StraightOn):
    def predict_std(self, state, times):
        return np.full(len(times), -self.std)


class Bending(StraightOn):
    """Goes on along a circle of 0.1 m, as the path does."""

    def predict(self, state, times):
        rows = super().predict(state, times)
        rows[:, 3] += (np.asarray(times) - state.stamp) * 2.0
        return rows


class WrappedYaw(Bending):
    def predict(self, state, times):
        rows = super().predict(state, times)
        rows[:, 3] = np.arctan2(np.sin(rows[:, 3]), np.cos(rows[:, 3]))
        return rows


class YawInDegrees(StraightOn):
    def predict(self, state, times):
        rows = super().predict(state, times)
        rows[:, 3] = np.rad2deg(rows[:, 3])
        return rows


class Remembers(StraightOn):
    """Smooths the points with a memory on the estimator itself."""

    last = None

    def update(self, state, stamp, p_WQ):
        if p_WQ is not None:
            self.last = p_WQ if self.last is None else 0.5 * (p_WQ + self.last)
            p_WQ = self.last
        return super().update(state, stamp, p_WQ)


class DrawsNumbers(StraightOn):
    def __init__(self):
        super().__init__()
        self.random = np.random.default_rng(0)

    def predict_std(self, state, times):
        return np.full(len(times), self.std)

    def update(self, state, stamp, p_WQ):
        return super().update(state, stamp, None if p_WQ is None else p_WQ + self.random.normal(scale=1e-3, size=3))


class WithoutStd:
    initial_state = update = ready = predict = StraightOn.initial_state


def without_stamp():
    estimator = StraightOn()
    estimator.initial_state = lambda: None
    return estimator
