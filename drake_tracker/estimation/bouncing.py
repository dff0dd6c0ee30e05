"""An estimator that notices bounces within two or three points.

A filter of smooth paths takes the points after a bounce for outliers, or for a sharp bend, and leaves them for several
images. This estimator wraps such a filter, as `drake_tracker.estimation.sudden_change` does for changes of speed. It
keeps the newest points, and the states of the filter after each of them. When the points leave the motion that was
expected from the oldest of these states as after a bounce (`drake_tracker.estimation.parts.bounce`), the filter
starts again with the points since the bounce. With two such points the filter that ignored them is still kept, in case
both were outliers; with three it is given up. As in the coordinated-turn filter, only the horizontal motion counts: the
height is filtered apart, and is not expected to bounce.
"""

from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.estimator import Estimator, EstimatorState, LimitedNoise
from drake_tracker.estimation.parts.bounce import LARGEST_MISFIT, Bounce, most_likely_bounce
from drake_tracker.estimation.sudden_change import (
    LONGEST_WINDOW,
    MARGIN,
    USUAL,
    WINDOW,
    RecentPoint,
    updated_usual,
)

MEMORY = 1.0
"""Time constant of the usual evidence [s]: a track of a real camera may last a few seconds only."""

SURE_AFTER = 3
"""Number of points after which a bounce is certain."""
FASTER = 1.5
"""Largest ratio of the speeds after and before a bounce that two points suffice to show: an object that bounces does
not become faster, whereas two outliers may be anywhere."""

NOTICED = 30.0
"""A bounce is noticed when the evidence exceeds so many times the usual one. With 10, the swaying of somebody who walks
was taken for bounces; those of a ball mostly reach 45 after two points and 100 after three."""

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


@dataclass(frozen=True, eq=False)
class BouncingState(FrozenState):
    """State of a `BouncingEstimator`.

    Attributes:
        calm: state of the filter that knows of no bounce in the window.
        bounced: state of the filter that knows of it, None without a bounce.
        recent: the newest points, oldest first. The first one is not tested: the others are expected from its state.
        usual: usual value of the evidence for a bounce while there is none.
    """

    calm: Any
    bounced: Any = None
    recent: tuple[RecentPoint, ...] = ()
    usual: float = USUAL

    @property
    def stamp(self) -> float:
        """Capture time of the newest point [s]."""
        return float(self.calm.stamp)

    @property
    def present(self) -> Any:
        """State of the filter that predicts."""
        return self.calm if self.bounced is None else self.bounced


class BouncingEstimator(Generic[State]):
    """An `Estimator` that makes another one notice bounces.

    Args:
        estimator: the other one.
    """

    def __init__(self, estimator: RestartingEstimator[State]) -> None:
        self._estimator = estimator
        self._limited = estimator.with_noise_below if isinstance(estimator, LimitedNoise) else None

    def initial_state(self) -> BouncingState:
        """Returns the state before the first point."""
        return BouncingState(self._estimator.initial_state())

    def ready(self, state: BouncingState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return self._estimator.ready(state.present)

    def update(self, state: BouncingState, stamp: float, p_WQ: np.ndarray | None) -> BouncingState:
        """Returns the state after a point. A point that the wrapped estimator does not use leaves it as it is.

        Args:
            state: the state before.
            stamp: capture time of the point [s].
            p_WQ: the point, shape (3,), in W [m].
        """
        calm = self._estimator.update(state.calm, stamp, p_WQ)
        if calm is state.calm or p_WQ is None:
            return state
        newest = RecentPoint(calm.stamp, read_only(np.array(p_WQ, dtype=float)), calm)
        kept = [recent for recent in state.recent[-WINDOW:] if newest.stamp - recent.stamp <= LONGEST_WINDOW]
        if not kept:
            recent = (newest,) if self._estimator.ready(calm) else ()
            return BouncingState(calm, recent=recent, usual=state.usual)
        state = replace(state, calm=calm, bounced=None, recent=(*kept, newest))
        bounce = self._most_likely_bounce(state)
        if bounce is None:
            return state
        if not (is_noticed(bounce, state.usual) and (bounce.after >= SURE_AFTER or self._is_slower(state, bounce))):
            state = replace(state, usual=updated_usual(state, bounce.evidence, MEMORY))
            return state if self._estimator.ready(calm) else replace(state, recent=())
        last = state.recent[-bounce.after - 1]
        rows = np.array([(recent.stamp, *recent.point) for recent in state.recent[-bounce.after :]])
        bounced = self._estimator.restarted(last.state, rows)
        if bounce.after < SURE_AFTER:
            return replace(state, bounced=bounced)
        return BouncingState(bounced, None, (replace(newest, state=bounced),), state.usual)

    def _most_likely_bounce(self, state: BouncingState) -> Bounce | None:
        """Returns the most likely bounce in the window, None if there are too few points."""
        base, *tested = state.recent
        stamps = np.array([recent.stamp for recent in tested])
        expected = self._estimator.predict(base.state, stamps)
        return most_likely_bounce(stamps - base.stamp, np.array([each.point[:2] for each in tested]) - expected[:, :2])

    def _is_slower(self, state: BouncingState, bounce: Bounce) -> bool:
        """Returns whether an object is not much faster after a bounce than before."""
        base, last = state.recent[0], state.recent[-1].stamp
        there = self._estimator.predict(base.state, np.array([base.stamp, last]))[:, :2]
        before = (there[1] - there[0]) / (last - base.stamp)
        return float(np.linalg.norm(before + bounce.gain)) <= FASTER * float(np.linalg.norm(before))

    def with_noise_below(self, state: BouncingState, sigma: float) -> BouncingState:
        """Returns a state that assumes at most a noise ``sigma`` per axis [m], if the wrapped estimator can."""
        if self._limited is None:
            return state
        bounced = None if state.bounced is None else self._limited(state.bounced, sigma)
        return replace(state, calm=self._limited(state.calm, sigma), bounced=bounced)

    def predict(self, state: BouncingState, times: np.ndarray) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        Args:
            state: the state to predict from.
            times: absolute times, shape (n,) [s].
        """
        return self._estimator.predict(state.present, times)

    def predict_std(self, state: BouncingState, times: np.ndarray) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it.

        Args:
            state: the state to predict from.
            times: absolute times, shape (n,) [s].
        """
        return self._estimator.predict_std(state.present, times)


def is_noticed(bounce: Bounce, usual: float) -> bool:
    """Returns whether the evidence for a bounce suffices.

    Args:
        bounce: the most likely bounce.
        usual: usual value of the evidence while there is none.
    """
    enough = bounce.evidence > NOTICED * usual and bounce.margin > MARGIN * usual
    return enough and bounce.misfit < LARGEST_MISFIT


def noticing_bounces(estimator: Estimator[Any]) -> Estimator[Any]:
    """Returns an estimator that notices bounces: the same one, if it cannot start again with a few points."""
    return BouncingEstimator(estimator) if isinstance(estimator, RestartingEstimator) else estimator
