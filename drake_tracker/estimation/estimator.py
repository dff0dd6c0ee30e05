"""The interface of an estimator and the registry of its kinds: measured points go in, a predicted path comes out.

An estimator is functional: it never changes itself or a state, and `Estimator.update` returns a new state. A run can
therefore be resumed from any earlier state, and a Drake Context can be cloned at no cost.
"""

from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.core.registry import Registry
from drake_tracker.estimation.config import AlphaBetaGamma, ArcLength, ClosedPath, CoordinatedTurn, InclinedPlane

ESTIMATORS: "Registry[Estimator[Any]]" = Registry(
    "estimator",
    {
        ClosedPath: "drake_tracker.estimation.closed_path:ClosedPathEstimator",
        CoordinatedTurn: "drake_tracker.estimation.coordinated_turn:CoordinatedTurnEstimator",
        ArcLength: "drake_tracker.estimation.arc_length:ArcLengthEstimator",
        AlphaBetaGamma: "drake_tracker.estimation.alpha_beta_gamma:AlphaBetaGammaEstimator",
        InclinedPlane: "drake_tracker.estimation.inclined_plane:InclinedPlaneEstimator",
    },
)
"""Every estimator of the package by its settings; the one place where an estimator is registered."""
SURFACE_ESTIMATORS = (InclinedPlane,)
"""Estimators that need the pose of a surface. All others predict any object on any path."""


def make_estimator(kind: Any, **parameters: Any) -> "Estimator[Any]":
    """Returns an estimator.

    Args:
        kind: the name of a kind, such as "closed_path", or an instance of its settings, such as ``ClosedPath()``.
        **parameters: with a name, settings of this kind and other keyword arguments of its class, such as ``period``.
            With settings, keyword arguments only; those that this kind does not take are ignored.

    Raises:
        DrakeTrackerError: the kind or a parameter is unknown, or a value is out of range.
    """
    if type(kind) in ESTIMATORS.makers:
        return ESTIMATORS.make(kind, **parameters)
    return ESTIMATORS.make_by_name(kind, **parameters)


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
