"""How a replay compares with its run: whether signals are bit-identical, and the errors of both from ground truth."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.tasks.episode import Predictions, predictions_ahead, predictions_of_now
from drake_tracker.tasks.plots import LONG, SHORT
from drake_tracker.tasks.task import Task

HORIZONS = (SHORT, LONG)
"""Horizons [s] at which predictions are judged."""


def compare_signals(recorded: Mapping[str, Signal], replayed: Mapping[str, Signal]) -> dict[str, dict[str, Any]]:
    """Returns {name: {"identical", "greatest_difference", "samples"}} of every replayed signal.

    A signal is identical when every sample and its time are, bit for bit. A run may have logged one more sample of the
    servo, after its last image; it is not compared. ``greatest_difference`` is that of the ``field`` with the greatest
    one.
    """
    return {name: _compare(recorded[name], signal) for name, signal in replayed.items()}


def _compare(before: Signal, after: Signal) -> dict[str, Any]:
    count = len(after.times)
    times, data = before.times[:count], before.data[:count]
    identical = times.tobytes() == after.times.tobytes() and data.tobytes() == after.data.tobytes()
    differences = np.max(np.abs(np.nan_to_num(data) - np.nan_to_num(after.data)), axis=0, initial=0.0)
    field = int(np.argmax(differences))
    found = {"identical": identical, "greatest_difference": float(differences[field]), "samples": count}
    return found if identical else found | {"field": after.names[field]}


class Judge:
    """Measures the errors of the signals of a log from ground truth. Errors are horizontal [m].

    Only the time in which the object moves freely is judged; see `Task.free_motion`. The log of the run tells which
    time that is, and where the object was.

    Args:
        task: task of the run.
        scenario: scenario of the run.
        log: {name: Signal} of the run.
    """

    def __init__(self, task: Task, scenario: Any, log: Mapping[str, Signal]) -> None:
        self._truth = log[task.truth_signal]
        self._motion = task.free_motion(scenario, log)
        self.spans = self._motion.spans

    def true_xy(self, times: np.ndarray) -> np.ndarray:
        """Returns where the object was at ``times`` (n,) [s], shape (n, 2) [m], NaN where nothing is logged."""
        truth = self._truth
        return np.column_stack([np.interp(times, truth.times, truth[k], left=np.nan, right=np.nan) for k in "xy"])

    def present(self, log: Mapping[str, Signal]) -> tuple[np.ndarray, np.ndarray]:
        """Returns (times (n,) [s], errors (n,) [m]) of the present position in the newest packet that the arm has."""
        now = predictions_of_now(log["delivered"])
        now = self._known(now, self._motion.tracked(now.times))
        return now.times, np.linalg.norm(now.xy - self.true_xy(now.times), axis=1)

    def ahead(self, log: Mapping[str, Signal], horizon: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns (times (n,) [s], errors (n,) [m]) of each packet's prediction ``horizon`` [s] after its stamp."""
        ahead = self.predictions(log, horizon)
        return ahead.times, np.linalg.norm(ahead.xy - self.true_xy(ahead.times), axis=1)

    def predictions(self, log: Mapping[str, Signal], horizon: float) -> Predictions:
        """Returns the `Predictions` that are judged, ``horizon`` [s] after the stamps of their packets."""
        ahead = predictions_ahead(log["prediction"], horizon)
        return self._known(ahead, self._motion.observed(ahead.stamps) & self.free(ahead.times))

    def rms(self, log: Mapping[str, Signal]) -> dict[str, float | None]:
        """Returns {name: rms error [m] or None} of the present position and of the predictions at `HORIZONS`."""
        found = {"position_rms_m": self.present(log)}
        found |= {f"prediction_{horizon:g}_s_rms_m": self.ahead(log, horizon) for horizon in HORIZONS}
        return {name: float(np.sqrt(np.mean(error**2))) if len(error) else None for name, (_, error) in found.items()}

    def free(self, times: np.ndarray) -> np.ndarray:
        """Returns at which of ``times`` (n,) [s] the object moved freely, shape (n,), bool."""
        return self._motion.free(times)

    def _known(self, predictions: Predictions, used: np.ndarray) -> Predictions:
        """Returns the predictions that are used and for whose time the truth is logged."""
        used = used & np.isfinite(self.true_xy(predictions.times)).all(axis=1)
        return Predictions(*(column[used] for column in predictions))
