"""An estimator that notices sudden changes of speed within a few points.

A filter of many points needs 0.1 s to be convinced of a new speed, and then takes the change for an acceleration that
goes on. This estimator wraps such a filter (`estimation/replay_window.py`). When the points leave the motion that was
expected (`estimation/parts/speed_change.py`), it returns to the state before the change, gives it the new speed, and
filters the points since then again. It repeats this at each new point, until the change is older than the window.
"""

from dataclasses import replace
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.estimation.estimator import Estimator, EstimatorState
from drake_tracker.estimation.parts.speed_change import SpeedChange, most_likely_change
from drake_tracker.estimation.replay_window import (
    MARGIN,
    WINDOW,
    RecentPoint,
    ReplayEstimator,
    ReplayState,
    updated_usual,
)

FEWEST = 5
"""Fewest points in which a change is searched for."""
NOTICED = 10.0
"""Ratio of the evidence for a change to its usual value from which on the change is real. The usual value is about the
expected value of the square of a normal variable, the largest of several, so that this is about four standard
deviations. This, `KEPT` and `MARGIN` were chosen on seeds 900 to 972, which no result uses."""
KEPT = 6.0
"""The same ratio for a change that the last point confirmed."""
CHORD, CHORD_LENGTH = 3, 0.010
"""Fewest points per chord of the distance travelled, and its expected length [m]: a chord is long against the noise,
and short against a bend."""
MEMORY = 4.0
"""Time constant of the usual value [s]."""

State = TypeVar("State", bound=EstimatorState)


@runtime_checkable
class SpeedEstimator(Estimator[State], Protocol[State]):
    """An estimator that can be told that its object has just changed its speed."""

    def with_speed(self, state: State, gain: float, std: float) -> State:
        """Returns the state of an object that has just changed its speed.

        Args:
            state: the state before.
            gain: change of the speed along the path [m/s].
            std: standard deviation of the new speed [m/s].
        """
        ...


class SuddenChangeEstimator(ReplayEstimator[SpeedEstimator[Any]]):
    """An `Estimator` that makes another one notice sudden changes of speed.

    Args:
        estimator: the other one.
    """

    def noticed(self, state: ReplayState, calm: Any, recent: tuple[RecentPoint, ...]) -> ReplayState:
        """Returns the state after a point, with the change of speed that the newest points show."""
        if not self._estimator.ready(calm):
            return ReplayState(calm, usual=state.usual)
        state = replace(state, calm=calm, recent=recent)
        if len(recent) <= FEWEST:
            return replace(state, changed=None)
        times, expected, away = self._expected(recent)
        along = np.cos(expected[:, 3]) * away[:, 0] + np.sin(expected[:, 3]) * away[:, 1]
        change = most_likely_change(times, along)
        if change is None:
            return replace(state, changed=None)
        if not is_real(change, state):
            return replace(state, changed=None, usual=updated_usual(state, change.evidence, MEMORY))
        if not shows_in_distance(change, times, expected[:, :2], away):
            return replace(state, changed=None)
        changed = self._replay(recent, change)
        if change.last > 1 or len(recent) <= WINDOW:
            return replace(state, changed=changed)
        # The change is about to leave the window; from now on it is the past.
        return ReplayState(changed, None, (replace(recent[-1], state=changed),), state.usual)

    def _replay(self, recent: tuple[RecentPoint, ...], change: SpeedChange) -> Any:
        """Returns the state of the filter that returns to the last point before a change and continues from there."""
        _, *tested = recent
        present = self._estimator.with_speed(tested[change.last].state, change.gain, abs(change.gain))
        for each in tested[change.last + 1 :]:
            present = self._estimator.update(present, each.stamp, each.point)
        return present


def shows_in_distance(change: SpeedChange, times: np.ndarray, expected: np.ndarray, away: np.ndarray) -> bool:
    """Returns whether the distance travelled since a change is nearer to that of the new speed than of the old one.

    An unexpected bend shortens the way along the expected path, but not the distance travelled.

    Args:
        change: the change.
        times: times of the tested points, shape (n,) [s].
        expected: their expected positions, shape (n, 2) [m].
        away: their residuals, shape (n, 2) [m].
    """
    step = float(np.hypot(*np.diff(expected[change.last :], axis=0).T).mean())
    points = CHORD_LENGTH / step if step > 0.0 else np.inf
    chord = int(min(max(CHORD, points), len(times) - 1 - change.last))
    since = slice(None, change.last - 1 if change.last else None, -chord)
    steps = (np.diff(places[since], axis=0) for places in (expected + away, expected))
    travelled, foreseen = (float(np.sum(np.hypot(*step.T))) for step in steps)
    duration = times[since][0] - times[since][-1]
    return (travelled - foreseen) / (change.gain * duration) > 0.5


def is_real(change: SpeedChange, state: ReplayState) -> bool:
    """Returns whether the evidence for a change suffices.

    Args:
        change: the most likely change.
        state: what is usual, and whether there was a change at the last point.
    """
    needed = NOTICED if state.changed is None else KEPT
    return change.evidence > needed * state.usual and change.margin > MARGIN * state.usual


def with_speed_change_detection(estimator: Estimator[Any]) -> Estimator[Any]:
    """Returns an estimator that notices sudden changes of speed; the given estimator, if its speed cannot be set."""
    return SuddenChangeEstimator(estimator) if isinstance(estimator, SpeedEstimator) else estimator
