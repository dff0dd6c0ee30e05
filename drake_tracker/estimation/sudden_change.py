"""An estimator that notices sudden changes of speed within a few points.

A filter that averages over many points is exact while the speed is constant, and slow when it is not: it needs 0.1 s or
more to be convinced, and then takes the change for an acceleration that goes on. This estimator wraps such a filter. It
keeps the newest points and the states of the filter between them. When the points leave the motion that was expected
from the oldest of these states (`drake_tracker.estimation.speed_change`), it returns to the state before the change,
gives it the new speed, and filters the points since then again. It does so at each new point, until the change is so
old that it need not be reconsidered. If the change turns out to be a mistake, the filter that ignored it is still there.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.estimation.estimator import Estimator, EstimatorState
from drake_tracker.estimation.speed_change import SpeedChange, most_likely_change

WINDOW = 14
"""Number of points in which a change is searched for."""
LONGEST_WINDOW = 0.4
"""The oldest point of them is at most this old [s]."""
NOTICED = 16.0
"""Ratio of the evidence of a change to its usual value at which a change is taken for real."""
KEPT = 8.0
"""The same ratio for a change that was taken for real before."""
MARGIN = 4.0
"""The evidence must exceed that of a jump by this much of the usual value."""
MEMORY = 4.0
"""Time constant of the usual value [s]."""
USUAL = 6.0
"""The usual value at first."""
LEAST_USUAL = 0.3
"""Least usual value: points are not more exact than this."""
LARGEST_SHARE = 4.0
"""No evidence counts more than this many times the usual value in the usual value."""

State = TypeVar("State", bound=EstimatorState)


@runtime_checkable
class Adjustable(Estimator[State], Protocol[State]):
    """An estimator that can be told the speed of its object."""

    def with_speed(self, state: State, gain: float, std: float) -> State:
        """Returns a state with another speed.

        Args:
            state: the state.
            gain: what is added to the speed [m/s].
            std: standard deviation of the new speed [m/s].
        """
        ...


@dataclass(frozen=True)
class RecentPoint(FrozenState):
    """A point of the last few tenths of a second.

    Attributes:
        stamp: its capture time [s].
        point: the point, shape (3,), in W [m].
        state: state of the filter after it.
    """

    stamp: float
    point: np.ndarray
    state: Any


@dataclass(frozen=True)
class SuddenChangeState(FrozenState):
    """State of a `SuddenChangeEstimator`.

    Attributes:
        calm: state of the filter that knows of no recent change.
        changed: state of the filter that does, None without a change.
        recent: the newest points, oldest first.
        usual: usual value of the evidence of a change, while there is none.
    """

    calm: Any
    changed: Any = None
    recent: tuple[RecentPoint, ...] = ()
    usual: float = USUAL

    @property
    def stamp(self) -> float:
        return self.calm.stamp

    @property
    def present(self) -> Any:
        return self.calm if self.changed is None else self.changed


class SuddenChangeEstimator:
    def __init__(self, estimator) -> None:
        self.estimator = estimator

    def initial_state(self):
        return SuddenChangeState(self.estimator.initial_state())

    def ready(self, state) -> bool:
        return self.estimator.ready(state.present)

    def update(self, state, stamp, p_WQ):
        calm = self.estimator.update(state.calm, stamp, p_WQ)
        if calm is state.calm or p_WQ is None:
            return state
        if not self.estimator.ready(calm):
            return SuddenChangeState(calm, usual=state.usual)
        newest = RecentPoint(calm.stamp, np.array(p_WQ, dtype=float), calm)
        recent = tuple(r for r in state.recent[-WINDOW:] if newest.stamp - r.stamp <= LONGEST_WINDOW) + (newest,)
        change = self._search(recent)
        if change is None:
            return SuddenChangeState(calm, None, recent, state.usual)
        ratio = change.evidence / state.usual
        sure = ratio > (NOTICED if state.changed is None else KEPT) and change.margin > MARGIN * state.usual
        if not sure:
            dt = newest.stamp - recent[-2].stamp
            gain = 1.0 - math.exp(-dt / MEMORY)
            usual = state.usual + gain * (min(change.evidence, LARGEST_SHARE * state.usual) - state.usual)
            return SuddenChangeState(calm, None, recent, max(usual, LEAST_USUAL))
        # index: times exclude the base
        changed = self.estimator.with_speed(recent[change.last + 1].state, change.gain, abs(change.gain))
        for point in recent[change.last + 2 :]:
            changed = self.estimator.update(changed, point.stamp, point.point)
        if change.last <= 1 and len(recent) > WINDOW:
            last = RecentPoint(newest.stamp, newest.point, changed)
            return SuddenChangeState(changed, None, (last,), state.usual)
        return SuddenChangeState(calm, changed, recent, state.usual)

    def _search(self, recent):
        if len(recent) < 6:
            return None
        stamps = np.array([r.stamp for r in recent[1:]])
        points = np.array([r.point for r in recent[1:]])
        expected = self.estimator.predict(recent[0].state, stamps)
        tangents = np.column_stack([np.cos(expected[:, 3]), np.sin(expected[:, 3])])
        along = np.sum(tangents * (points[:, :2] - expected[:, :2]), axis=1)
        return most_likely_change(stamps - recent[0].stamp, along)

    def predict(self, state, times):
        return self.estimator.predict(state.present, times)

    def predict_std(self, state, times):
        return self.estimator.predict_std(state.present, times)
