"""An estimator that notices sudden changes of speed within a few points.

A filter that averages over many points is exact while the speed is constant, and slow when it changes: it needs 0.1 s
to be convinced, and then takes the change for an acceleration that goes on. This estimator wraps such a filter. It
keeps the newest points, and the states of the filter after each of them. When the points leave the motion that was
expected from the oldest of these states (`estimation/parts/speed_change.py`), it returns to the state before the
change, gives it the new speed, and filters the points since then again. It repeats this at each new point, until the
change is older than the window. If the change turns out to be a mistake, the filter that ignored it is still there.

While nothing is noticed, the predictions are those of the wrapped filter, bit for bit.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.estimator import Estimator, EstimatorState
from drake_tracker.estimation.parts.speed_change import SpeedChange, most_likely_change

WINDOW = 14
"""Number of points in which a change is searched for, 0.23 s at 60 Hz."""
LONGEST_WINDOW = 0.4
"""Largest age of the oldest of them [s]."""
FEWEST = 5
"""Fewest points in which a change is searched for."""
NOTICED = 10.0
"""Ratio of the evidence for a change to its usual value from which on the change is real. The usual value is about the
expected value of the square of a normal variable, the largest of several, so that this is about four standard
deviations. This and the next two constants were chosen on seeds 900 to 972, which no result uses."""
KEPT = 6.0
"""The same ratio for a change that was found to be real at the last point."""
MARGIN = 2.0
"""The evidence must exceed that for a jump by this much of the usual value."""
MEMORY = 4.0
"""Time constant of the usual value [s]."""
USUAL = 6.0
"""The usual value at first; the test is cautious until it knows the noise."""
LEAST_USUAL = 0.3
"""Least usual value: points are not more exact than about half a millimetre."""
LARGEST_SHARE = 4.0
"""In the usual value no evidence counts as more than this many times the usual value."""

State = TypeVar("State", bound=EstimatorState)


@runtime_checkable
class SpeedEstimator(Estimator[State], Protocol[State]):
    """An estimator that can be told that its object has just changed its speed."""

    def with_speed(self, state: State, gain: float, std: float) -> State:
        """Returns the state of an object that has just changed its speed.

        Args:
            state: the state before.
            gain: change of the speed along the path [m/s].
            std: standard deviation of the new speed [m/s].
        """
        ...


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
class SuddenChangeState(FrozenState):
    """State of a `SuddenChangeEstimator`.

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


class Tested(Protocol):
    """What `updated_usual` needs of a state."""

    @property
    def recent(self) -> tuple[RecentPoint, ...]:
        """The newest points, oldest first."""
        ...

    @property
    def usual(self) -> float:
        """Usual value of the evidence."""
        ...


class SuddenChangeEstimator(Generic[State]):
    """An `Estimator` that makes another one notice sudden changes of speed.

    Args:
        estimator: the other one.
    """

    def __init__(self, estimator: SpeedEstimator[State]) -> None:
        self._estimator = estimator

    def initial_state(self) -> SuddenChangeState:
        """Returns the state before the first point."""
        return SuddenChangeState(self._estimator.initial_state())

    def ready(self, state: SuddenChangeState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return self._estimator.ready(state.present)

    def update(self, state: SuddenChangeState, stamp: float, p_WQ: np.ndarray | None) -> SuddenChangeState:
        """Returns the state after a point. A point that the wrapped estimator does not use leaves it as it is.

        Args:
            state: the state before.
            stamp: capture time of the point [s].
            p_WQ: the point, shape (3,), in W [m].
        """
        calm = self._estimator.update(state.calm, stamp, p_WQ)
        if calm is state.calm or p_WQ is None:
            return state
        if not self._estimator.ready(calm):
            return SuddenChangeState(calm, usual=state.usual)
        newest = RecentPoint(calm.stamp, read_only(np.array(p_WQ, dtype=float)), calm)
        kept = [recent for recent in state.recent[-WINDOW:] if newest.stamp - recent.stamp <= LONGEST_WINDOW]
        state = replace(state, calm=calm, recent=(*kept, newest))
        change = self._most_likely_change(state)
        if change is None:
            return replace(state, changed=None)
        if not is_real(change, state):
            return replace(state, changed=None, usual=updated_usual(state, change.evidence))
        changed = self._replay(state, change)
        if change.last > 1 or len(state.recent) <= WINDOW:
            return replace(state, changed=changed)
        # The change is about to leave the window; from now on it is the past.
        return SuddenChangeState(changed, None, (replace(newest, state=changed),), state.usual)

    def _most_likely_change(self, state: SuddenChangeState) -> SpeedChange | None:
        """Returns the most likely change in the window, None if there are too few points."""
        base, *tested = state.recent
        if len(tested) < FEWEST:
            return None
        stamps = np.array([recent.stamp for recent in tested])
        expected = self._estimator.predict(base.state, stamps)
        away = np.array([recent.point[:2] for recent in tested]) - expected[:, :2]
        along = np.cos(expected[:, 3]) * away[:, 0] + np.sin(expected[:, 3]) * away[:, 1]
        return most_likely_change(stamps - base.stamp, along)

    def _replay(self, state: SuddenChangeState, change: SpeedChange) -> State:
        """Returns the state of the filter that returns to the last point before a change and continues from there."""
        _, *tested = state.recent
        present = self._estimator.with_speed(tested[change.last].state, change.gain, abs(change.gain))
        for recent in tested[change.last + 1 :]:
            present = self._estimator.update(present, recent.stamp, recent.point)
        return present

    def predict(self, state: SuddenChangeState, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        Args:
            state: the state to predict from.
            times: absolute times, shape (n,) [s].
        """
        return self._estimator.predict(state.present, times)

    def predict_std(self, state: SuddenChangeState, times: np.ndarray) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it.

        Args:
            state: the state to predict from.
            times: absolute times, shape (n,) [s].
        """
        return self._estimator.predict_std(state.present, times)


def is_real(change: SpeedChange, state: SuddenChangeState) -> bool:
    """Returns whether the evidence for a change suffices.

    Args:
        change: the most likely change.
        state: what is usual, and whether there was a change at the last point.
    """
    needed = NOTICED if state.changed is None else KEPT
    return change.evidence > needed * state.usual and change.margin > MARGIN * state.usual


def updated_usual(state: Tested, evidence: float, memory: float = MEMORY) -> float:
    """Returns the usual value of the evidence after another point without a change.

    Args:
        state: the usual value before, and the last two points.
        evidence: evidence at the newest point.
        memory: time constant of the usual value [s].
    """
    dt = state.recent[-1].stamp - state.recent[-2].stamp
    gain = 1.0 - math.exp(-dt / memory)
    return max(state.usual + gain * (min(evidence, LARGEST_SHARE * state.usual) - state.usual), LEAST_USUAL)


def with_speed_change_detection(estimator: Estimator[Any]) -> Estimator[Any]:
    """Returns an estimator that notices sudden changes of speed: the same one, if it cannot be told the speed."""
    return SuddenChangeEstimator(estimator) if isinstance(estimator, SpeedEstimator) else estimator
