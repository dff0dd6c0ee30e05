"""An estimator that notices bounces within two or three points.

A filter of smooth paths takes the points after a bounce for outliers, or for a sharp bend, and leaves them for several
images. This estimator wraps such a filter (`estimation/replay_window.py`). When the points leave the motion that was
expected as after a bounce (`estimation/parts/bounce.py`), the filter starts again with the points since the bounce.
With two such points the filter that ignored them is still kept, in case both were outliers; with three it is given up.
As in the coordinated-turn filter, only the horizontal motion counts: the height is filtered apart, and is not expected
to bounce.
"""

from dataclasses import replace
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.estimation.estimator import Estimator, EstimatorState, LimitedNoise
from drake_tracker.estimation.parts.bounce import LARGEST_MISFIT, Bounce, most_likely_bounce
from drake_tracker.estimation.replay_window import MARGIN, RecentPoint, ReplayEstimator, ReplayState, updated_usual

MEMORY = 1.0
"""Time constant of the usual evidence [s]: a track of a real camera may last a few seconds only."""

SURE_AFTER = 3
"""Number of points after which a bounce is certain."""
FASTER = 1.5
"""Largest ratio of the speeds after and before a bounce that two points suffice to show: an object that bounces does
not become faster, whereas two outliers may be anywhere."""

NOTICED = 30.0
"""A bounce is noticed when the evidence exceeds so many times the usual one. With 10, the swaying of a walking person
was taken for bounces. Bounces of a ball mostly reach 45 after two points and 100 after three."""

State = TypeVar("State", bound=EstimatorState)


@runtime_checkable
class RestartingEstimator(Estimator[State], Protocol[State]):
    """An estimator that can start again with a few points, and predicts from there on."""

    def restarted(self, state: State, rows: np.ndarray) -> State:
        """Returns the state of an object that has just begun to move along the line through its newest points.

        Args:
            state: the state before.
            rows: the points since then (stamp [s], x, y, z [m]), oldest first, shape (n, 4), at least two.
        """
        ...


class BouncingEstimator(ReplayEstimator[RestartingEstimator[Any]]):
    """An `Estimator` that makes another one notice bounces.

    Args:
        estimator: the other one.
    """

    def __init__(self, estimator: RestartingEstimator[Any]) -> None:
        super().__init__(estimator)
        self._limited = estimator.with_noise_below if isinstance(estimator, LimitedNoise) else None

    def noticed(self, state: ReplayState, calm: Any, recent: tuple[RecentPoint, ...]) -> ReplayState:
        """Returns the state after a point, with the bounce that the newest points show."""
        if len(recent) == 1:
            return ReplayState(calm, recent=recent if self._estimator.ready(calm) else (), usual=state.usual)
        state = replace(state, calm=calm, changed=None, recent=recent)
        times, _, away = self._expected(recent)
        bounce = most_likely_bounce(times, away)
        if bounce is None:
            return state
        if not (is_noticed(bounce, state.usual) and (bounce.after >= SURE_AFTER or self._is_slower(state, bounce))):
            state = replace(state, usual=updated_usual(state, bounce.evidence, MEMORY))
            return state if self._estimator.ready(calm) else replace(state, recent=())
        rows = np.array([(each.stamp, *each.point) for each in recent[-bounce.after :]])
        bounced = self._estimator.restarted(recent[-bounce.after - 1].state, rows)
        if bounce.after < SURE_AFTER:
            return replace(state, changed=bounced)
        return ReplayState(bounced, None, (replace(recent[-1], state=bounced),), state.usual)

    def _is_slower(self, state: ReplayState, bounce: Bounce) -> bool:
        """Returns whether an object is not much faster after a bounce than before."""
        base, last = state.recent[0], state.recent[-1].stamp
        there = self._estimator.predict(base.state, np.array([base.stamp, last]))[:, :2]
        before = (there[1] - there[0]) / (last - base.stamp)
        return float(np.linalg.norm(before + bounce.gain)) <= FASTER * float(np.linalg.norm(before))

    def with_noise_below(self, state: ReplayState, sigma: float) -> ReplayState:
        """Returns a state that assumes at most a noise ``sigma`` per axis [m], if the wrapped estimator can."""
        if self._limited is None:
            return state
        changed = None if state.changed is None else self._limited(state.changed, sigma)
        return replace(state, calm=self._limited(state.calm, sigma), changed=changed)


def is_noticed(bounce: Bounce, usual: float) -> bool:
    """Returns whether the evidence for a bounce suffices.

    Args:
        bounce: the most likely bounce.
        usual: usual value of the evidence while there is none.
    """
    enough = bounce.evidence > NOTICED * usual and bounce.margin > MARGIN * usual
    return enough and bounce.misfit < LARGEST_MISFIT


def noticing_bounces(estimator: Estimator[Any]) -> Estimator[Any]:
    """Returns an estimator that notices bounces; the given estimator, if it cannot start again with a few points."""
    return BouncingEstimator(estimator) if isinstance(estimator, RestartingEstimator) else estimator
