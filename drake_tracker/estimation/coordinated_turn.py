"""The coordinated-turn estimator: two coordinated-turn filters with different process noise of the curvature.

The change of curvature is a property of the path: a rectangle with round corners needs several times the process noise
of an oval. With the wrong process noise, the errors double. The noise is therefore estimated online. One filter expects
gentle bends, the other sharp bends. The prediction is the weighted mean of both predictions; the weights follow from
the errors of the filters' predictions during the last seconds. This is a static bank of filters (Bar-Shalom, Li and
Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 11.6.2), with two differences. The
errors of predictions `AHEAD` are compared, not the innovations of the next point, because correlated noise of the
points makes the latter favour the larger process noise. And the past is forgotten, because a path may change.

A sharp bend does not last long. The filter that expects them predicts that the curvature fades, see `fading_turn`.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.config import CoordinatedTurn
from drake_tracker.estimation.parts.turn_filter import MIN_SPEED, TurnFilter, TurnFilterState
from drake_tracker.estimation.parts.turn_model import SPEED, fading_turn, turn_step

AHEAD = 0.25
"""Predictions this far ahead are judged: the lag of vision [s]."""
JUDGE_EVERY = 0.05
"""Least time between two judged predictions [s]."""
MEMORY = 4.0
"""Time constant with which their errors are forgotten [s]."""
EXPONENT = 0.5 * MEMORY / AHEAD
"""Power of the mean squares in the likelihood of Gaussian errors of unknown variance: half the number of independent
errors, of which there is one every `AHEAD`."""
NOISE_FLOOR = 0.001
"""Errors well below this do not distinguish the filters [m]."""
MAX_ERROR = 0.1
"""Larger errors count as this [m], so that a single one cannot decide for long."""
START_ERRORS = (0.003, 0.006)
"""Root mean square errors of the two filters that are assumed at first: gentle bends are more likely [m]."""


@dataclass(frozen=True)
class Judged(FrozenState):
    """A prediction of both filters that is not due yet.

    Attributes:
        due: time for which it was made [s].
        gentle: x, y [m] and heading [rad] predicted by the filter of gentle bends, shape (3,).
        sharp: the same by the filter of sharp bends.
    """

    due: float
    gentle: np.ndarray
    sharp: np.ndarray


@dataclass(frozen=True)
class CoordinatedTurnState(FrozenState):
    """State of an `CoordinatedTurnEstimator`.

    Attributes:
        gentle: state of the filter that expects gentle bends.
        sharp: state of the filter that expects sharp bends.
        pending: predictions that are not due yet, oldest first.
        squares: mean squares of the lateral errors of past predictions, gentle and sharp [m^2].
    """

    gentle: TurnFilterState
    sharp: TurnFilterState
    pending: tuple[Judged, ...] = ()
    squares: tuple[float, float] = (START_ERRORS[0] ** 2, START_ERRORS[1] ** 2)

    @property
    def stamp(self) -> float:
        """Capture time of the newest point [s]."""
        return self.gentle.stamp


class CoordinatedTurnEstimator:
    """An `Estimator` of an object on a path with gentle or sharp bends.

    Args:
        settings: see `CoordinatedTurn`.
        climb_noise: process noise of the climb [m/s/sqrt(s)].

    Raises:
        DrakeTrackerError: a parameter is out of range.
    """

    def __init__(self, settings: CoordinatedTurn = CoordinatedTurn(), *, climb_noise: float = 0.005) -> None:
        self.settings = settings
        self._gentle = TurnFilter(settings, climb_noise=climb_noise)
        sharp = replace(settings, bend_noise=settings.sharp_bend_noise)
        self._sharp = TurnFilter(sharp, climb_noise=climb_noise)

    def initial_state(self) -> CoordinatedTurnState:
        """Returns the state before the first point."""
        return CoordinatedTurnState(self._gentle.initial_state(), self._sharp.initial_state())

    def with_speed(self, state: CoordinatedTurnState, gain: float, std: float) -> CoordinatedTurnState:
        """Returns the state of an object that has just changed its speed, see `TurnFilter.with_speed`.

        Earlier predictions say nothing about the bends.
        """
        gentle, sharp = (
            f.with_speed(s, gain, std) for f, s in ((self._gentle, state.gentle), (self._sharp, state.sharp))
        )
        return CoordinatedTurnState(gentle, sharp, (), state.squares)

    def restarted(self, state: CoordinatedTurnState, rows: np.ndarray) -> CoordinatedTurnState:
        """Returns the state of an object that has just begun to move along the line through its newest points.

        Args:
            state: the state before, see `TurnFilter.restarted`.
            rows: the points since then (stamp [s], x, y, z [m]), oldest first, shape (n, 4), at least two.
        """
        gentle, sharp = self._gentle.restarted(state.gentle, rows), self._sharp.restarted(state.sharp, rows)
        return CoordinatedTurnState(gentle, sharp, (), state.squares)

    def with_noise_below(self, state: CoordinatedTurnState, sigma: float) -> CoordinatedTurnState:
        """Returns a state in which both filters assume at most a noise ``sigma`` per axis [m]."""
        gentle = self._gentle.with_noise_below(state.gentle, sigma)
        sharp = self._sharp.with_noise_below(state.sharp, sigma)
        return replace(state, gentle=gentle, sharp=sharp)

    def ready(self, state: CoordinatedTurnState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return state.gentle.ready or state.sharp.ready

    def update(self, state: CoordinatedTurnState, stamp: float, p_WQ: np.ndarray | None) -> CoordinatedTurnState:
        """Returns the state after a point, see `Estimator.update`.

        A point that is None, not finite, or not newer than the state leaves the state as it is. Each filter decides by
        itself whether the point is an outlier, see `TurnFilter.update`.
        """
        gentle = self._gentle.update(state.gentle, stamp, p_WQ)
        if gentle is state.gentle or p_WQ is None:
            return state
        sharp = self._sharp.update(state.sharp, stamp, p_WQ)
        if gentle.start is not None or sharp.start is not None:  # what was predicted before a restart says nothing
            return CoordinatedTurnState(gentle, sharp, (), state.squares)
        pending, squares = state.pending, state.squares
        if not (gentle.outliers or sharp.outliers):
            pending, squares = _judge(pending, squares, gentle.stamp, float(p_WQ[0]), float(p_WQ[1]))
        due = gentle.stamp + AHEAD
        wanted = not pending or due - pending[-1].due > JUDGE_EVERY - 1e-9
        if wanted and gentle.ready and sharp.ready and abs(gentle.mean[SPEED]) > MIN_SPEED:
            pending = (*pending, self._prediction(gentle, sharp, due))
        return CoordinatedTurnState(gentle, sharp, pending, squares)

    def _prediction(self, gentle: TurnFilterState, sharp: TurnFilterState, due: float) -> Judged:
        """Returns what both filters predict for the time ``due`` [s], `AHEAD`."""
        later, _ = turn_step(gentle.mean, AHEAD)
        fading = fading_turn(sharp.mean, np.array([AHEAD]), self.settings.sharp_bend_length)
        return Judged(due, read_only(later[:3]), read_only(fading[0]))

    def _predictions(self, state: CoordinatedTurnState, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the paths predicted by the filters of gentle and of sharp bends, each of shape (n, 4)."""
        gentle = self._gentle.predict(state.gentle, times)
        if state.sharp.start is not None:
            return gentle, self._sharp.predict(state.sharp, times)
        later, sharp = times - state.sharp.stamp, np.empty((len(times), 4))
        sharp[:, [0, 1, 3]] = fading_turn(state.sharp.mean, later, self.settings.sharp_bend_length)
        sharp[:, 2] = state.sharp.height[0] + later * state.sharp.height[1]
        return gentle, sharp

    def predict(self, state: CoordinatedTurnState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad], which is the heading."""
        gentle, sharp = self._predictions(state, np.asarray(times, dtype=float))
        apart = sharp - gentle
        turns = np.arctan2(np.sin(apart[:, 3]), np.cos(apart[:, 3]))
        apart[:, 3] = np.unwrap(turns)  # the filters may turn apart by more than half a turn
        return gentle + sharp_share(state) * apart

    def predict_std(self, state: CoordinatedTurnState, times: ArrayLike) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it."""
        share = sharp_share(state)
        gentle, sharp = self._gentle.predict_std(state.gentle, times), self._sharp.predict_std(state.sharp, times)
        return np.sqrt((1.0 - share) * gentle**2 + share * sharp**2)


def sharp_share(state: CoordinatedTurnState) -> float:
    """Returns the weight of the filter of sharp bends, from 0 to 1.

    Only one filter may have had enough points since it was restarted; it then has all the weight.
    """
    if state.gentle.ready != state.sharp.ready:
        return float(state.sharp.ready)
    gentle, sharp = (square + NOISE_FLOOR**2 for square in state.squares)
    return 1.0 / (1.0 + (sharp / gentle) ** EXPONENT)


def _judge(
    pending: tuple[Judged, ...], squares: tuple[float, float], stamp: float, x: float, y: float
) -> tuple[tuple[Judged, ...], tuple[float, float]]:
    """Returns the predictions that are still not due, and the mean squares after judging the others by a point.

    Only the error across the predicted direction counts: the error along it shows changes of the speed. A prediction
    that is overdue by `JUDGE_EVERY` or more is dropped.

    Args:
        pending: the predictions.
        squares: the mean squares before [m^2].
        stamp: capture time of the point [s].
        x: x of the point [m].
        y: y of the point [m].
    """
    gain = 1.0 - math.exp(-JUDGE_EVERY / MEMORY)
    while pending and pending[0].due <= stamp + 1e-9:
        judged, pending = pending[0], pending[1:]
        if stamp - judged.due < JUDGE_EVERY:
            gentle, sharp = squares
            gentle += gain * (_lateral(judged.gentle, x, y) ** 2 - gentle)
            sharp += gain * (_lateral(judged.sharp, x, y) ** 2 - sharp)
            squares = (gentle, sharp)
    return pending, squares


def _lateral(predicted: np.ndarray, x: float, y: float) -> float:
    """Returns the distance of the point (x, y) [m] from the predicted line, up to `MAX_ERROR`.

    Args:
        predicted: x, y [m] and heading [rad], shape (3,).
        x: x of the point [m].
        y: y of the point [m].
    """
    x_then, y_then, heading = predicted.tolist()
    return min(MAX_ERROR, abs(math.cos(heading) * (y - y_then) - math.sin(heading) * (x - x_then)))
