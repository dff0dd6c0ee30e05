"""Common part of estimators that notice sudden changes: they wrap a filter, and return to its state before the change.

A filter that averages over many points is exact while an object moves smoothly, and slow when the motion changes. A
wrapper keeps the newest points, and the state of the filter after each point. When the points leave the motion that was
expected from the oldest of these states, the wrapper returns to the state before the change, and filters the points
since then again. If the change turns out to be a mistake, the filter that ignored it is still there.

While nothing is noticed, the predictions are those of the wrapped filter, bit for bit.
"""

import math
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.estimator import Estimator, PathLearner

WINDOW = 14
"""Number of points in which a change is searched for, 0.23 s at 60 Hz."""
LONGEST_WINDOW = 0.4
"""Largest age of the oldest of them [s]."""
MARGIN = 2.0
"""The evidence must exceed that for a jump by this much of the usual value."""
USUAL = 6.0
"""The usual value at first; the test is cautious until it knows the noise."""
LEAST_USUAL = 0.3
"""Least usual value: points are not more exact than about half a millimetre."""
LARGEST_SHARE = 4.0
"""In the usual value no evidence counts as more than this many times the usual value."""

Wrapped = TypeVar("Wrapped", bound=Estimator[Any])


@dataclass(frozen=True, eq=False)
class RecentPoint(FrozenState):
    """A point of the last tenths of a second.

    Attributes:
        stamp: its capture time [s].
        point: the point, shape (3,), in W [m].
        state: state after it of the filter that knows of no change in the window.
    """

    stamp: float
    point: np.ndarray
    state: Any


@dataclass(frozen=True, eq=False)
class ReplayState(FrozenState):
    """State of a `ReplayEstimator`.

    Attributes:
        calm: state of the filter that knows of no change in the window.
        changed: state of the filter that knows of it, None without a change.
        recent: the newest points, oldest first. The first one is not tested: the others are expected from its state.
        usual: usual value of the evidence for a change while there is none.
    """

    calm: Any
    changed: Any = None
    recent: tuple[RecentPoint, ...] = ()
    usual: float = USUAL

    @property
    def stamp(self) -> float:
        """Capture time of the newest point [s]."""
        return float(self.calm.stamp)

    @property
    def present(self) -> Any:
        """State of the filter that predicts."""
        return self.calm if self.changed is None else self.changed


class ReplayEstimator(Generic[Wrapped]):
    """An `Estimator` that makes another one notice sudden changes. A derived class says which changes in `noticed`.

    Args:
        estimator: the other one.
    """

    def __init__(self, estimator: Wrapped) -> None:
        self._estimator = estimator

    def initial_state(self) -> ReplayState:
        """Returns the state before the first point."""
        return ReplayState(self._estimator.initial_state())

    def ready(self, state: ReplayState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return self._estimator.ready(state.present)

    def update(self, state: ReplayState, stamp: float, p_WQ: np.ndarray | None) -> ReplayState:
        """Returns the state after a point. A point that the wrapped estimator does not use leaves it as it is.

        Args:
            state: the state before.
            stamp: capture time of the point [s].
            p_WQ: the point, shape (3,), in W [m].
        """
        calm = self._estimator.update(state.calm, stamp, p_WQ)
        if calm is state.calm or p_WQ is None:
            return state
        newest = RecentPoint(calm.stamp, read_only(np.array(p_WQ, dtype=float)), calm)
        kept = [recent for recent in state.recent[-WINDOW:] if newest.stamp - recent.stamp <= LONGEST_WINDOW]
        return self.noticed(state, calm, (*kept, newest))

    def noticed(self, state: ReplayState, calm: Any, recent: tuple[RecentPoint, ...]) -> ReplayState:
        """Returns the state after a point, with the evidence for a change.

        Args:
            state: the state before.
            calm: state of the wrapped filter after the point.
            recent: the newest points, the newest of all last.
        """
        raise NotImplementedError

    def _expected(self, recent: tuple[RecentPoint, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the times since the oldest point, shape (n,) [s], the expected positions of the other points, shape
        (n, 4), and their residuals, shape (n, 2) [m]."""
        base, *tested = recent
        stamps = np.array([each.stamp for each in tested])
        expected = self._estimator.predict(base.state, stamps)
        return stamps - base.stamp, expected, np.array([each.point[:2] for each in tested]) - expected[:, :2]

    def knows_path(self, state: ReplayState) -> bool:
        """Returns whether the wrapped estimator has learned the path."""
        return isinstance(self._estimator, PathLearner) and self._estimator.knows_path(state.present)

    def predict(self, state: ReplayState, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        Args:
            state: the state to predict from.
            times: absolute times, shape (n,) [s].
        """
        return self._estimator.predict(state.present, times)

    def predict_std(self, state: ReplayState, times: np.ndarray) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it.

        Args:
            state: the state to predict from.
            times: absolute times, shape (n,) [s].
        """
        return self._estimator.predict_std(state.present, times)


def updated_usual(state: ReplayState, evidence: float, memory: float) -> float:
    """Returns the usual value of the evidence after another point without a change.

    Args:
        state: the usual value before, and the last two points.
        evidence: evidence at the newest point.
        memory: time constant of the usual value [s].
    """
    dt = state.recent[-1].stamp - state.recent[-2].stamp
    gain = 1.0 - math.exp(-dt / memory)
    return max(state.usual + gain * (min(evidence, LARGEST_SHARE * state.usual) - state.usual), LEAST_USUAL)
