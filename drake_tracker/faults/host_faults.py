"""Faults of the host: it stops, and starts again with an empty memory."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.estimation.estimator import Estimator
from drake_tracker.faults.fault import HostFault


@dataclass(frozen=True)
class HostStoppedFault(HostFault):
    """`HostStopped`.

    Attributes:
        lag: time from an image to the point at the estimator [s]. An estimator is told the capture time of its points,
            from which this gives the time at which it gets them.
    """

    lag: float = 0.0

    def estimator(self, estimator: Estimator[Any]) -> Estimator[Any]:
        return StoppedEstimator(estimator, self)

    def stopped(self, stamp: float) -> bool:
        """Returns whether the host has stopped when it should get the point of a capture time [s]."""
        return self.active(stamp + self.lag)


@dataclass(frozen=True)
class StoppedState(FrozenState):
    """State of a `StoppedEstimator`.

    Attributes:
        inner: state of the estimator.
        running: whether the host runs.
    """

    inner: Any
    running: bool = True

    @property
    def stamp(self) -> float:
        """Capture time of the newest point in the state [s]; -inf before the first point."""
        return self.inner.stamp if self.running else -math.inf


@dataclass(frozen=True)
class StoppedEstimator:
    """An estimator that loses all it has learned, and predicts nothing, while a fault lasts. Implements `Estimator`.

    Attributes:
        inner: the estimator.
        fault: the fault.
    """

    inner: Estimator[Any]
    fault: HostStoppedFault

    def initial_state(self) -> StoppedState:
        """Returns the state before the first point."""
        return StoppedState(self.inner.initial_state())

    def update(self, state: StoppedState, stamp: float, p_WQ: np.ndarray | None) -> StoppedState:
        """Returns the state after a point; see `Estimator.update`."""
        if self.fault.stopped(stamp):
            return StoppedState(self.inner.initial_state(), running=False) if state.running else state
        inner = self.inner.update(state.inner, stamp, p_WQ)
        return state if inner is state.inner else StoppedState(inner)

    def ready(self, state: StoppedState) -> bool:
        """Returns whether the state holds enough data for a prediction."""
        return state.running and self.inner.ready(state.inner)

    def predict(self, state: StoppedState, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path; see `Estimator.predict`."""
        return self.inner.predict(state.inner, times)

    def predict_std(self, state: StoppedState, times: np.ndarray) -> np.ndarray:
        """Returns the expected error of the predicted path; see `Estimator.predict_std`."""
        return self.inner.predict_std(state.inner, times)
