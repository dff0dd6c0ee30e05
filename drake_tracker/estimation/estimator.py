"""The interface of an estimator: measured points go in, a predicted path comes out.

An estimator is functional: it never changes itself or a state, and `Estimator.update` returns a new state. A run can
therefore be resumed from any earlier state, and a Drake Context can be cloned at no cost.
"""

from typing import Protocol, TypeVar, runtime_checkable

import numpy as np


@runtime_checkable
class EstimatorState(Protocol):
    """What an estimator remembers: an immutable value, normally a frozen dataclass."""

    @property
    def stamp(self) -> float:
        """Capture time of the newest point in the state [s]; -inf before the first point."""
        ...


State = TypeVar("State", bound=EstimatorState)


@runtime_checkable
class Estimator(Protocol[State]):
    """Filters the measured points of a moving object and predicts its path.

    `drake_tracker.estimation.check.check_estimator` verifies that an object behaves as described here.
    """

    def initial_state(self) -> State:
        """Returns the state before the first point."""
        ...

    def update(self, state: State, stamp: float, p_WQ: np.ndarray | None) -> State:
        """Returns the state after a point.

        Args:
            state: the state before the point, which must not be changed.
            stamp: capture time of the point [s].
            p_WQ: the measured point, shape (3,), in W [m]; None when there is no valid point at this time, and then
                ``state`` itself is returned.
        """
        ...

    def ready(self, state: State) -> bool:
        """Returns whether the state holds enough data for a prediction."""
        ...

    def predict(self, state: State, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw about W's z axis [rad].

        Args:
            state: a state that is ready.
            times: absolute times, shape (n,) [s]; the first is usually ``state.stamp``.
        """
        ...

    def predict_std(self, state: State, times: np.ndarray) -> np.ndarray:
        """Returns the expected position error of the predicted path, shape (n,) [m].

        About 68 % of the errors should be smaller.

        Args:
            state: a state that is ready.
            times: absolute times, shape (n,) [s].
        """
        ...


@runtime_checkable
class LimitedNoise(Estimator[State], Protocol[State]):
    """An estimator whose estimate of the noise can be limited."""

    def with_noise_below(self, state: State, sigma: float) -> State:
        """Returns a state that assumes at most a noise ``sigma`` per axis [m]."""
        ...
