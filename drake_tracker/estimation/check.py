"""Tries an estimator on a few seconds of points, and says in one line what it does not do as it should."""

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, raised
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING
from drake_tracker.core.timing import VISION_PERIOD

METHODS = ("initial_state", "update", "ready", "predict", "predict_std")
"""What an estimator does; see `drake_tracker.estimation`."""
_SECONDS, _RADIUS, _SPEED, _HEIGHT = 2.0, 0.2, 0.15, 0.47


def check_estimator(estimator, name=None):
    """Raises DrakeTrackerError, one line, when an estimator cannot be used in the loop.

    It is given points on a circle of 0.2 m radius at 0.15 m/s, 60 a second for 2 s, one of them missing. Once it says
    that it is ready, its predictions must have the shapes that `drake_tracker.estimation` names and be finite, and no
    update may change a state that was returned before: a run is replayed from such states.

    ``name``: of the estimator, for the message; by default its class.
    """
    name = name or type(estimator).__name__
    missing = [method for method in METHODS if not callable(getattr(estimator, method, None))]
    if missing:
        raise DrakeTrackerError(f"{name} has no method {', '.join(missing)}; an estimator has {', '.join(METHODS)}")
    try:
        trouble = _drive(estimator)
    except (Exception, SystemExit) as error:
        raise DrakeTrackerError(f"{name} {raised(error)}") from error
    if trouble:
        raise DrakeTrackerError(f"{name}.{trouble}")


def _drive(estimator):
    """Returns what is wrong, beginning with the method's name; None for nothing."""
    state = estimator.initial_state()
    if not hasattr(state, "stamp"):
        return f"initial_state returned a {type(state).__name__} without stamp, the newest point's time"
    for k in range(round(_SECONDS / VISION_PERIOD)):
        stamp = (k + 1) * VISION_PERIOD
        if k == 40:
            if estimator.update(state, stamp, None) is not state:
                return "update must return the state that it was given when the point is None"
            continue
        times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
        before = estimator.predict(state, times) if estimator.ready(state) else None
        new = estimator.update(state, stamp, _point(stamp))
        if new is state:
            return "update returned the very state that it was given; a new point makes a new state"
        if getattr(new, "stamp", None) != stamp:
            return f"update returned a state whose stamp is {getattr(new, 'stamp', None)}, not the point's, {stamp:.4f}"
        if before is not None:
            for method, shape, needed in (("predict", (KNOT_COUNT, 4), " (rows x, y, z, yaw)"),
                                          ("predict_std", (KNOT_COUNT,), "")):  # fmt: skip
                result = np.asarray(getattr(estimator, method)(new, times), dtype=float)
                if result.shape != shape:
                    return f"{method} returned the shape {result.shape} for {KNOT_COUNT} times, not {shape}{needed}"
                if not np.all(np.isfinite(result)):
                    return f"{method} returned a number that is not finite"
            if not np.array_equal(before, estimator.predict(state, times)):
                return "update changed the state that it was given; make a new one"
        state = new
    return None


def _point(time):
    angle = _SPEED / _RADIUS * time
    return np.array([0.56 + _RADIUS * np.cos(angle), _RADIUS * np.sin(angle), _HEIGHT])
