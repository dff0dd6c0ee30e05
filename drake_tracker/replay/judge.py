"""Compares a replay with its run: whether signals are bit-identical, and the errors of both against ground truth."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.episode import Predictions, predictions_ahead, predictions_of_now
from drake_tracker.tasks.plots import LONG, SHORT
from drake_tracker.tasks.task import Task

HORIZONS = (SHORT, LONG)
"""Horizons [s] at which predictions are judged."""


def compare_signals(recorded: Mapping[str, Signal], replayed: Mapping[str, Signal]) -> dict[str, dict[str, Any]]:
    """Returns {name: {"identical", "greatest_difference", "samples"}} for all replayed signals of the run.

    A signal is identical when all samples and their times agree bit for bit. Otherwise ``field`` is the name of the
    field with the greatest difference. A signal that the run did not log, since an earlier version made it, is omitted.
    Samples in only one of both signals, such as the last sample of the servo, are not compared.

    Args:
        recorded: {name: Signal} of the run.
        replayed: {name: Signal} of the replay.
    """
    return {name: _compare(recorded[name], signal) for name, signal in replayed.items() if name in recorded}


def _compare(before: Signal, after: Signal) -> dict[str, Any]:
    count = min(len(before.times), len(after.times))
    old, new = before.data[:count], after.data[:count]
    identical = before.times[:count].tobytes() == after.times[:count].tobytes() and old.tobytes() == new.tobytes()
    differences = np.max(np.abs(np.nan_to_num(old) - np.nan_to_num(new)), axis=0, initial=0.0)
    field = int(np.argmax(differences))
    found = {"identical": identical, "greatest_difference": float(differences[field]), "samples": count}
    return found if identical else found | {"field": after.names[field]}


class Judge:
    """Measures the errors of logged predictions against ground truth. Errors are horizontal [m].

    Only the time in which the object moves freely is judged, see `Task.free_motion`. This time and the true path of the
    object come from the log of the run.

    Args:
        task: task of the run.
        scenario: scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        spans: phases of the run.
    """

    def __init__(self, task: Task, scenario: BaseScenario, log: Mapping[str, Signal]) -> None:
        self._truth = task.judged_log(scenario, log)[task.truth_signal]
        self._motion = task.free_motion(scenario, log)
        self.spans = self._motion.spans

    def true_xy(self, times: np.ndarray) -> np.ndarray:
        """Returns the true (x, y) of the object in W [m], shape (n, 2), at times (n,) [s]; NaN where not logged."""
        truth = self._truth
        return np.column_stack([np.interp(times, truth.times, truth[k], left=np.nan, right=np.nan) for k in "xy"])

    def present(self, log: Mapping[str, Signal]) -> tuple[np.ndarray, np.ndarray]:
        """Returns (times [s], errors [m]) of the present position according to the newest packet of the arm.

        Args:
            log: {name: Signal} of a run or replay.
        """
        now = predictions_of_now(log["delivered"])
        now = self._known(now, self._motion.tracked(now.times))
        return now.times, np.linalg.norm(now.xy - self.true_xy(now.times), axis=1)

    def ahead(self, log: Mapping[str, Signal], horizon: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns (times [s], errors [m]) of each packet's prediction for a fixed time after its stamp.

        Args:
            log: {name: Signal} of a run or replay.
            horizon: time after the stamp [s].
        """
        ahead = self.predictions(log, horizon)
        return ahead.times, np.linalg.norm(ahead.xy - self.true_xy(ahead.times), axis=1)

    def predictions(self, log: Mapping[str, Signal], horizon: float) -> Predictions:
        """Returns the predictions that are judged, for a fixed time after the stamps of their packets.

        Args:
            log: {name: Signal} of a run or replay.
            horizon: time after the stamp [s].
        """
        ahead = predictions_ahead(log["prediction"], horizon)
        return self._known(ahead, self._motion.observed(ahead.stamps) & self.free(ahead.times))

    def rms(self, log: Mapping[str, Signal]) -> dict[str, float | None]:
        """Returns {name: rms error [m]} of the present position and of the predictions at `HORIZONS`; None: no data.

        Args:
            log: {name: Signal} of a run or replay.
        """
        found = {"position_rms_m": self.present(log)}
        found |= {f"prediction_{horizon:g}_s_rms_m": self.ahead(log, horizon) for horizon in HORIZONS}
        return {name: float(np.sqrt(np.mean(error**2))) if len(error) else None for name, (_, error) in found.items()}

    def free(self, times: np.ndarray) -> np.ndarray:
        """Returns at which of the times (n,) [s] the object moved freely, shape (n,), bool."""
        return self._motion.free(times)

    def _known(self, predictions: Predictions, used: np.ndarray) -> Predictions:
        """Returns the predictions that are used, shape (n,) bool, and for whose time the ground truth is logged."""
        used = used & np.isfinite(self.true_xy(predictions.times)).all(axis=1)
        return Predictions(*(column[used] for column in predictions))
