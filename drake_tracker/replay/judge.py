"""How a replay compares with its run: the same signals to the last bit or not, and the errors of both from truth."""

import numpy as np

from drake_tracker.grasp.catch_schema import CatchPhase
from drake_tracker.grasp.schema import Phase
from drake_tracker.tasks.ball.summary import ROLLING, last_verdict
from drake_tracker.tasks.episode import (
    Predictions,
    during,
    phase_spans,
    predictions_ahead,
    predictions_of_now,
    sighted,
)
from drake_tracker.tasks.train.figures import LONG, SHORT

HORIZONS = (SHORT, LONG)
"""Horizons [s] at which predictions are judged."""
_RUNNING = (Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT)
_STATE = {"train": "truth_train_state", "ball": "truth_ball_state"}


def compare_signals(recorded, replayed):
    """Returns {name: {"identical", "greatest_difference", "samples"}} of every replayed signal.

    Identical is every sample and its time, bit for bit. A run may have logged a servo sample more, of the time after
    its last image; it is not compared. The greatest difference is that of the ``field`` in which it is greatest.
    """
    return {name: _compare(recorded[name], signal) for name, signal in replayed.items()}


def _compare(before, after):
    count = len(after.times)
    times, data = before.times[:count], before.data[:count]
    identical = times.tobytes() == after.times.tobytes() and data.tobytes() == after.data.tobytes()
    differences = np.max(np.abs(np.nan_to_num(data) - np.nan_to_num(after.data)), axis=0, initial=0.0)
    field = int(np.argmax(differences))
    found = {"identical": identical, "greatest_difference": float(differences[field]), "samples": count}
    return found if identical else found | {"field": after.names[field]}


class Judge:
    """Measures how far from the object the signals of a log put it. Errors are horizontal [m].

    Judged is the time in which the object goes its own way: until a hand closes on the train; from a tenth of a second
    after the ball's release until it leaves the board. Which that is, and where the object was, the run's log tells.

    Args:
        scenario: of the run. log: {name: Signal} of the run.
    """

    def __init__(self, scenario, log):
        self._task, self._truth = scenario.task, log[_STATE[scenario.task]]
        phases = Phase if self._task == "train" else CatchPhase
        self.spans = phase_spans(log, scenario.time_step, phases)
        if self._task == "ball":
            verdict = last_verdict(log)
            self._rolls = (verdict.released + ROLLING, verdict.crossing_time or np.inf) if verdict.released else None

    def true_xy(self, times):
        """Returns where the object was at ``times`` (n,) [s], shape (n, 2) [m], NaN where nothing is logged."""
        truth = self._truth
        return np.column_stack([np.interp(times, truth.times, truth[k], left=np.nan, right=np.nan) for k in "xy"])

    def present(self, log):
        """Returns (times (n,) [s], errors (n,) [m]) of what the arm's newest packet says of the present."""
        now = predictions_of_now(log["delivered"])
        used = during(self.spans, now.times, Phase.TRACK) if self._task == "train" else self.runs(now.times)
        now = self._known(now, used)
        return now.times, np.linalg.norm(now.xy - self.true_xy(now.times), axis=1)

    def ahead(self, log, horizon):
        """Returns (times (n,) [s], errors (n,) [m]) of each packet's prediction ``horizon`` [s] after its stamp."""
        ahead = self.predictions(log, horizon)
        return ahead.times, np.linalg.norm(ahead.xy - self.true_xy(ahead.times), axis=1)

    def predictions(self, log, horizon):
        """Returns the `Predictions` that are judged, ``horizon`` [s] after the stamps of their packets."""
        ahead = predictions_ahead(log["prediction"], horizon)
        seen = sighted(self.spans, ahead.stamps) if self._task == "train" else self.runs(ahead.stamps)
        return self._known(ahead, seen & self.runs(ahead.times))

    def rms(self, log):
        """Returns {name: rms error [m] or None}: of the present position and of the predictions at `HORIZONS`."""
        found = {"position_rms_m": self.present(log)}
        found |= {f"prediction_{horizon:g}_s_rms_m": self.ahead(log, horizon) for horizon in HORIZONS}
        return {name: float(np.sqrt(np.mean(error**2))) if len(error) else None for name, (_, error) in found.items()}

    def runs(self, times):
        """Returns at which of ``times`` (n,) [s] the object went its own way, shape (n,), bool."""
        if self._task == "train":
            return during(self.spans, times, *_RUNNING)
        start, end = self._rolls or (np.inf, -np.inf)
        return (times > start) & (times < end)

    def _known(self, predictions, used):
        """Returns those of the predictions that are used and for whose time the truth is logged."""
        used = used & np.isfinite(self.true_xy(predictions.times)).all(axis=1)
        return Predictions(*(column[used] for column in predictions))
