"""The interface of an estimator and the registry of its kinds: measured points go in, a predicted path comes out.

An estimator is functional: it never changes itself or a state, and `Estimator.update` returns a new state. A run can
therefore be resumed from any earlier state, and a Drake Context can be cloned at no cost. `check_estimator` tries an
estimator on two seconds of points and reports the first violation in one line.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.registry import Registry
from drake_tracker.core.timing import KNOT_COUNT, KNOT_SPACING, VISION_PERIOD
from drake_tracker.estimation.checked_estimator import CheckedEstimator
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


@runtime_checkable
class PathLearner(Estimator[State], Protocol[State]):
    """An estimator that can learn a path."""

    def knows_path(self, state: State) -> bool:
        """Returns whether the path has been learned, so that bends ahead are known."""
        ...


METHODS = tuple(name for name in vars(Estimator) if not name.startswith("_"))
"""Names of the methods of an `Estimator`."""
_DURATION, _RADIUS, _SPEED, _HEIGHT = 2.0, 0.2, 0.15, 0.47
_MISSING = 40
"""Number of the point that is missing."""
_SLOWEST, _LARGEST_ANGLE = 0.02, 1.0
"""From this speed on [m/s], the yaw may differ from the direction of the predicted path by this angle [rad] at most."""


def check_estimator(estimator: Any, name: str | None = None) -> None:
    """Raises DrakeTrackerError, one line, when an estimator cannot be used in the loop.

    The estimator is given points on a circle of 0.2 m radius at 0.15 m/s, 60 per second for 2 s, one of them missing.
    From the time that it is ready, its predictions must have the shapes that `Estimator` describes and be finite, the
    yaw must be the direction of the path, continuous and in radians, and no standard deviation may be negative. No
    update may change a state that was returned before, because a run is replayed from such states. A second object,
    whose points come in between, must not change the predictions.

    Args:
        estimator: what is checked.
        name: name of the estimator in the message; by default that of its class.
    """
    name = name or type(estimator).__name__
    missing = [method for method in METHODS if not callable(getattr(estimator, method, None))]
    if missing:
        raise DrakeTrackerError(f"{name} has no method {', '.join(missing)}; an estimator has {', '.join(METHODS)}")
    checked = CheckedEstimator(estimator, name)
    alone = _predict(checked, [_point], f"{name}.update changed the state that it was given; it must return a new one")
    together = _predict(checked, [_point, _other_point])
    if len(alone) != len(together) or not all(map(np.array_equal, alone, together)):
        raise DrakeTrackerError(
            f"{name} gave other predictions for the same points when it was given a second object in between; all "
            "memory must be in the state, and random numbers must follow from it"
        )
    if alone:
        steps = np.diff(alone[-1][:, :2], axis=0)
        moving = np.hypot(*steps.T) > _SLOWEST * KNOT_SPACING
        wrong = np.abs(np.angle(np.exp(1j * (alone[-1][:-1, 3] - np.arctan2(steps[:, 1], steps[:, 0])))))[moving]
        if len(wrong) and np.median(wrong) > _LARGEST_ANGLE:
            raise DrakeTrackerError(
                f"{name}.predict returned a yaw that is {np.median(wrong):.2f} rad from the direction in which the "
                "predicted path leads; it must be this direction, in radians"
            )


def _predict(
    estimator: CheckedEstimator, objects: Sequence[Callable[[float], np.ndarray]], changed: str = ""
) -> list[np.ndarray]:
    """Returns the predictions for the first object after each of its points, from when the estimator is ready.

    Args:
        estimator: gets the points of all objects in turn, each with its own state.
        objects: functions that return the place of an object at a time.
        changed: if given, message of the error that is raised when an update changes an earlier state.
    """
    states, rows = [estimator.initial_state() for _ in objects], []
    for k in range(round(_DURATION / VISION_PERIOD)):
        stamp = (k + 1) * VISION_PERIOD
        times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
        for number, place in enumerate(objects):
            state = states[number]
            before = estimator.predict(state, times) if changed and estimator.ready(state) else None
            p_WQ = None if k == _MISSING else place(stamp)
            states[number] = new = estimator.update(state, stamp, p_WQ)
            _check_state(estimator.name, state, new, stamp, p_WQ)
            if not estimator.ready(new):
                continue
            predicted = estimator.predict(new, times)
            estimator.predict_std(new, times)
            if before is not None and not np.array_equal(before, estimator.predict(state, times)):
                raise DrakeTrackerError(changed)
            if number == 0:
                rows.append(predicted)
    return rows


def _check_state(name: str, state: Any, new: Any, stamp: float, p_WQ: np.ndarray | None) -> None:
    """Raises DrakeTrackerError unless ``new`` is a state after the point ``p_WQ`` that was seen at ``stamp`` [s]."""
    if p_WQ is None:
        if new is not state:
            raise DrakeTrackerError(f"{name}.update must return the same state when the point is None")
    elif new is state:
        raise DrakeTrackerError(f"{name}.update returned the same state for a new point; it must return a new one")
    elif getattr(new, "stamp", None) != stamp:
        found = getattr(new, "stamp", None)
        raise DrakeTrackerError(f"{name}.update returned a state with stamp {found} for a point of {stamp:.4f} s")


def _point(time: float) -> np.ndarray:
    """Returns the point on the circle at ``time`` [s], shape (3,), in W [m]."""
    angle = _SPEED / _RADIUS * time
    return np.array([0.56 + _RADIUS * np.cos(angle), _RADIUS * np.sin(angle), _HEIGHT])


def _other_point(time: float) -> np.ndarray:
    """Returns a point on another circle at another speed, shape (3,), in W [m]."""
    return np.array([0.3, -0.3, _HEIGHT]) + 0.1 * np.array([np.sin(0.8 * time), np.cos(0.8 * time), 0.0])
