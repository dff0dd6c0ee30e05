"""The interface of an estimator and the registry of its kinds: measured points go in, a predicted path comes out.

An estimator is functional: it never changes itself or a state, and `Estimator.update` returns a new state. A run can
therefore be resumed from any earlier state, and a Drake Context can be cloned at no cost. `check_estimator` tries an
estimator on two seconds of points and reports the first violation in one line.
"""

from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, raised
from drake_tracker.core.registry import Registry
from drake_tracker.core.timing import KNOT_COUNT, KNOT_SPACING, VISION_PERIOD
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
    """The memory of an estimator: an immutable value, normally a frozen dataclass."""

    @property
    def stamp(self) -> float:
        """Capture time of the newest point in the state [s]; -inf before the first point."""
        ...


State = TypeVar("State", bound=EstimatorState)


@runtime_checkable
class Estimator(Protocol[State]):
    """Filters the measured points of a moving object and predicts its path.

    `check_estimator` verifies that an object behaves as described here.
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


METHODS = tuple(name for name in vars(Estimator) if not name.startswith("_"))
"""Names of the methods of an `Estimator`."""
_DURATION, _RADIUS, _SPEED, _HEIGHT = 2.0, 0.2, 0.15, 0.47


def check_estimator(estimator: Any, name: str | None = None) -> None:
    """Raises DrakeTrackerError, one line, when an estimator cannot be used in the loop.

    The estimator is given points on a circle of 0.2 m radius at 0.15 m/s, 60 per second for 2 s, one of them missing.
    From the time that it is ready, its predictions must have the shapes that `Estimator` describes and be finite. No
    update may change a state that was returned before, because a run is replayed from such states.

    Args:
        estimator: what is checked.
        name: name of the estimator in the message; by default that of its class.
    """
    name = name or type(estimator).__name__
    missing = [method for method in METHODS if not callable(getattr(estimator, method, None))]
    if missing:
        raise DrakeTrackerError(f"{name} has no method {', '.join(missing)}; an estimator has {', '.join(METHODS)}")
    try:
        error_found = _find_error(estimator)
    except (Exception, SystemExit) as error:
        raise DrakeTrackerError(f"{name} {raised(error)}") from error
    if error_found:
        raise DrakeTrackerError(f"{name}.{error_found}")


def _find_error(estimator: Estimator[Any]) -> str | None:
    """Returns the violation, beginning with the name of the method; None if nothing is."""
    state = estimator.initial_state()
    if not hasattr(state, "stamp"):
        return f"initial_state returned a {type(state).__name__} without stamp, the capture time of the newest point"
    for k in range(round(_DURATION / VISION_PERIOD)):
        stamp = (k + 1) * VISION_PERIOD
        if k == 40:
            if estimator.update(state, stamp, None) is not state:
                return "update must return the same state when the point is None"
            continue
        times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
        before = estimator.predict(state, times) if estimator.ready(state) else None
        new = estimator.update(state, stamp, _point(stamp))
        if new is state:
            return "update returned the same state for a new point; it must return a new one"
        if getattr(new, "stamp", None) != stamp:
            return f"update returned a state with stamp {getattr(new, 'stamp', None)} for a point of {stamp:.4f} s"
        if before is not None:
            for method, shape, columns in (("predict", (KNOT_COUNT, 4), " (rows x, y, z, yaw)"),
                                           ("predict_std", (KNOT_COUNT,), "")):  # fmt: skip
                result = np.asarray(getattr(estimator, method)(new, times), dtype=float)
                if result.shape != shape:
                    return f"{method} returned the shape {result.shape} for {KNOT_COUNT} times, not {shape}{columns}"
                if not np.all(np.isfinite(result)):
                    return f"{method} returned a number that is not finite"
            if not np.array_equal(before, estimator.predict(state, times)):
                return "update changed the state that it was given; it must return a new one"
        state = new
    return None


def _point(time: float) -> np.ndarray:
    """Returns the point on the circle at ``time`` [s], shape (3,), in W [m]."""
    angle = _SPEED / _RADIUS * time
    return np.array([0.56 + _RADIUS * np.cos(angle), _RADIUS * np.sin(angle), _HEIGHT])
