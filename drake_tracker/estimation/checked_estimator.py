"""An estimator of the user, of which every result is checked: in `check_estimator` and during a run.

The rules are stated here only. The packet guard of the arm refuses packets that break them; here the message names the
method, file and line instead of a packet.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, PartError, raised

LARGEST_STD = 1e3
"""Largest expected error of a position [m]."""
LARGEST_TURN = math.pi
"""Largest change of the direction from one time to the next [rad]; a larger one is a yaw that was not unwrapped."""


class CheckedEstimator:
    """An `Estimator` that calls another one and raises PartError for an error in it, or for a wrong result.

    Args:
        estimator: the other one.
        name: its name in messages.
    """

    def __init__(self, estimator: Any, name: str) -> None:
        self._estimator, self.name = estimator, name

    def initial_state(self) -> Any:
        """Returns the state before the first point."""
        state = self._call("initial_state")
        if not hasattr(state, "stamp"):
            raise self._error(
                f"initial_state returned a {type(state).__name__} without stamp, the capture time of the newest point"
            )
        return state

    def update(self, state: Any, stamp: float, p_WQ: np.ndarray | None) -> Any:
        """Returns the state after a point."""
        return self._call("update", state, stamp, p_WQ)

    def ready(self, state: Any) -> bool:
        """Returns whether the state holds enough data for a prediction."""
        return bool(self._call("ready", state))

    def predict(self, state: Any, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4)."""
        rows = self._numbers("predict", state, times, (len(times), 4), " (rows x, y, z, yaw)")
        turns = np.abs(np.diff(rows[:, 3]))
        if len(turns) and turns.max() > LARGEST_TURN:
            raise self._error(
                f"predict returned a yaw that changes by {turns.max():.3g} rad from one time to the next; yaw must be "
                "in radians and continuous (numpy.unwrap)"
            )
        return rows

    def predict_std(self, state: Any, times: np.ndarray) -> np.ndarray:
        """Returns the expected position error, shape (n,) [m]."""
        stds = self._numbers("predict_std", state, times, (len(times),), "")
        if len(stds) and (stds.min() < 0.0 or stds.max() > LARGEST_STD):
            worst = stds.min() if stds.min() < 0.0 else stds.max()
            raise self._error(f"predict_std returned {worst:.3g}; it must return 0 to {LARGEST_STD:g} m")
        return stds

    def _numbers(self, method: str, state: Any, times: np.ndarray, shape: tuple[int, ...], columns: str) -> np.ndarray:
        result = self._call(method, state, times)
        try:
            numbers = np.asarray(result, dtype=float)
        except (TypeError, ValueError):
            raise self._error(f"{method} returned a {type(result).__name__}; it must return numbers") from None
        if numbers.shape != shape:
            raise self._error(
                f"{method} returned the shape {numbers.shape} for {len(times)} times, not {shape}{columns}"
            )
        if not np.isfinite(numbers).all():
            raise self._error(f"{method} returned a number that is not finite")
        return numbers

    def _call(self, method: str, *arguments: Any) -> Any:
        try:
            return getattr(self._estimator, method)(*arguments)
        except DrakeTrackerError:
            raise
        except (Exception, SystemExit) as error:
            raise PartError(f"{self.name}.{method} {raised(error)}") from error

    def _error(self, text: str) -> PartError:
        """Returns the error for a wrong result; ``text`` begins with the name of the method."""
        code = getattr(getattr(self._estimator, text.partition(" ")[0], None), "__code__", None)
        place = f" ({Path(code.co_filename).name} line {code.co_firstlineno})" if code else ""
        return PartError(f"{self.name}.{text}{place}")
