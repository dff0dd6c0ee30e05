"""Tries an estimator on two seconds of points and reports in one line what it does wrong."""

from typing import Any

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, raised
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.estimator import Estimator

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
    """Returns what is wrong, beginning with the name of the method; None if nothing is."""
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
