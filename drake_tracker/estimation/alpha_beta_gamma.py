"""The authors' earlier estimator: alpha-beta-gamma filters of x, y and z (Allen et al. 1991, section 4)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.config import AlphaBetaGamma
from drake_tracker.estimation.parameters import check_positive, check_settings
from drake_tracker.estimation.parts.alpha_beta_gamma_filter import AlphaBetaGammaFilter, AlphaBetaGammaState
from drake_tracker.estimation.parts.error_growth import HORIZON, ErrorGrowth

_INTERVALS = 7
"""Number of intervals between points whose median is the interval for which the filters are tuned."""


@dataclass(frozen=True)
class CartesianState(FrozenState):
    """State of an `AlphaBetaGammaEstimator`.

    Attributes:
        stamp: capture time of the newest point [s].
        horizontal: state of the filter of x and y.
        vertical: state of the filter of z.
        started: capture time of the first point since the last restart [s].
        heading: direction of travel, held at low speed [rad].
        ready: whether there is enough data for a prediction.
        growth: errors of recent predictions.
        intervals: times between the newest points [s], at most `_INTERVALS`.
    """

    stamp: float
    horizontal: AlphaBetaGammaState
    vertical: AlphaBetaGammaState
    started: float = 0.0
    heading: float = 0.0
    ready: bool = False
    growth: ErrorGrowth = ErrorGrowth()
    intervals: tuple[float, ...] = ()


class AlphaBetaGammaEstimator:
    """An `Estimator` that extrapolates x, y and z at constant acceleration.

    The direction of the path is that of the velocity.

    Args:
        settings: see `AlphaBetaGamma`. The tracking indices apply to points at 60 Hz.
        period: sampling interval T [s]. The tracking index scales with T^(5/2): with T^2 by Kalata's definition, and
            with the square root of T since the acceleration is a random walk. If most of the newest points arrive at
            another interval, the index is scaled to that interval, in steps of half an octave.

    Raises:
        DrakeTrackerError: a parameter is out of range.
    """

    def __init__(self, settings: AlphaBetaGamma = AlphaBetaGamma(), *, period: float = VISION_PERIOD) -> None:
        check_settings(settings, AlphaBetaGamma, zero_allowed=("ready_after",))
        check_positive("alpha_beta_gamma", period=period)
        self.settings = settings
        self._period = period
        self._tuned = {0: self._filters(period)}
        self._horizontal, self._vertical = self._tuned[0]

    def _filters(self, period: float) -> tuple[AlphaBetaGammaFilter, AlphaBetaGammaFilter]:
        """Returns the horizontal and the vertical filter for points at an interval [s]."""
        scale, settings = (period / VISION_PERIOD) ** 2.5, self.settings
        steps = {"restart_after": settings.restart_after, "min_dt": 0.5 * period}
        return (
            AlphaBetaGammaFilter(2, scale * settings.tracking_index, **steps),
            AlphaBetaGammaFilter(1, scale * settings.vertical_tracking_index, **steps),
        )

    def _suited(self, intervals: tuple[float, ...]) -> tuple[AlphaBetaGammaFilter, AlphaBetaGammaFilter]:
        """Returns the filters for the intervals at which points arrive, shape (n,) [s]."""
        if len(intervals) < _INTERVALS:
            return self._tuned[0]
        steps = round(2.0 * math.log2(sorted(intervals)[_INTERVALS // 2] / self._period))
        if steps not in self._tuned:
            self._tuned[steps] = self._filters(self._period * 2.0 ** (0.5 * steps))
        return self._tuned[steps]

    def initial_state(self) -> CartesianState:
        """Returns the state before the first point."""
        return CartesianState(-np.inf, self._horizontal.initial_state(), self._vertical.initial_state())

    def ready(self, state: CartesianState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return state.ready

    def update(self, state: CartesianState, stamp: float, p_WQ: np.ndarray | None) -> CartesianState:
        """Returns the state after a point, see `Estimator.update`.

        A point that is None, not finite, or not newer than the state leaves the state as it is.
        """
        if p_WQ is None or not np.isfinite(stamp) or not np.all(np.isfinite(p_WQ)) or stamp <= state.stamp:
            return state
        p_WQ = np.asarray(p_WQ, dtype=float)
        settings = self.settings
        restart = stamp - state.stamp > settings.restart_after
        started = stamp if restart else state.started
        growth = state.growth.forget() if restart else state.growth
        intervals = () if restart else (*state.intervals, stamp - state.stamp)[-_INTERVALS:]
        across, upright = self._suited(intervals)
        horizontal = across.update(state.horizontal, stamp, p_WQ[:2])
        vertical = upright.update(state.vertical, stamp, p_WQ[2:])
        vx, vy = horizontal.v
        heading = np.arctan2(vy, vx) if np.hypot(vx, vy) >= settings.min_speed else state.heading
        ready = stamp - started >= settings.ready_after - 1e-9
        if ready:
            later, _, _ = self._horizontal.predict(horizontal, stamp + HORIZON)
            growth = growth.update(stamp, horizontal.x, later)
        return CartesianState(
            float(stamp), horizontal, vertical, float(started), float(heading), bool(ready), growth, intervals
        )

    def predict(self, state: CartesianState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        yaw is the direction of the velocity, continuous along the rows, and held where the speed is below
        ``min_speed``.
        """
        times = np.asarray(times, dtype=float)
        if not np.isfinite(state.stamp):
            return np.zeros((len(times), 4))
        xy, v, _ = self._horizontal.predict(state.horizontal, times[:, None])
        z, _, _ = self._vertical.predict(state.vertical, times[:, None])
        fast = np.hypot(v[:, 0], v[:, 1]) >= self.settings.min_speed
        yaw = np.where(fast, np.arctan2(v[:, 1], v[:, 0]), state.heading)
        if len(times):  # a slow row takes the yaw of the last fast row before it
            yaw = yaw[np.maximum.accumulate(np.where(fast, np.arange(len(times)), 0))]
        return np.column_stack([xy, z, np.unwrap(yaw)])

    def predict_std(self, state: CartesianState, times: ArrayLike) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]."""
        horizon = np.asarray(times, dtype=float) - (state.stamp if np.isfinite(state.stamp) else 0.0)
        return state.growth.std(horizon, self.settings.systematic_std)
