"""The authors' earlier estimator: alpha-beta-gamma filters of x, y and z (Allen et al. 1991, section 4)."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.alpha_beta_gamma import AlphaBetaGammaFilter, AlphaBetaGammaState
from drake_tracker.estimation.error_growth import HORIZON, ErrorGrowth
from drake_tracker.estimation.parameters import not_negative, positive


@dataclass(frozen=True)
class CartesianState:
    """State of `AlphaBetaGamma`: newest stamp [s], the filters of (x, y) and z, held heading [rad], recent errors."""

    stamp: float
    horizontal: AlphaBetaGammaState
    vertical: AlphaBetaGammaState
    started: float = 0.0
    heading: float = 0.0
    ready: bool = False
    growth: ErrorGrowth = ErrorGrowth()

    def __deepcopy__(self, memo):
        return self


class AlphaBetaGamma:
    """The Cartesian estimator: alpha-beta-gamma filters of x, y and z, run on at constant acceleration.

    The path's direction is that of the velocity.  Functional; all memory is in the `CartesianState`.

    Args:
        tracking_index: of x and y, for points at 60 Hz.
        vertical_tracking_index: of z, which changes little, likewise.
        period: sampling interval T [s].  The index goes with its power 5/2: with the square by Kalata's definition, and
            with the root since an acceleration wanders so.
        systematic_std: error of a point [m] that the filter cannot see, for `predict_std`.
        min_speed: below it [m/s] the last heading is held.
        restart_after: a gap between points [s] after which the filter starts afresh.
        ready_after: time span of points [s] needed for a prediction.
    """

    def __init__(
        self,
        *,
        tracking_index=0.001,
        vertical_tracking_index=1e-5,
        period=VISION_PERIOD,
        systematic_std=0.006,
        min_speed=0.02,
        restart_after=0.3,
        ready_after=0.6,
    ):
        of = "alpha_beta_gamma"
        positive(of, tracking_index=tracking_index, vertical_tracking_index=vertical_tracking_index, period=period)
        positive(of, restart_after=restart_after)
        not_negative(of, systematic_std=systematic_std, min_speed=min_speed, ready_after=ready_after)
        scale = (period / VISION_PERIOD) ** 2.5
        steps = {"restart_after": restart_after, "shortest": 0.5 * period}
        self._horizontal = AlphaBetaGammaFilter(2, scale * tracking_index, **steps)
        self._vertical = AlphaBetaGammaFilter(1, scale * vertical_tracking_index, **steps)
        self.systematic_std = systematic_std
        self.min_speed = min_speed
        self.restart_after = restart_after
        self.ready_after = ready_after

    def initial_state(self):
        return CartesianState(-np.inf, self._horizontal.initial_state(), self._vertical.initial_state())

    def ready(self, state):
        """Returns whether there is enough data for a prediction."""
        return state.ready

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ, shape (3,) [m, W], captured at ``stamp`` [s].

        A point that is None, not finite, or not newer than the newest one returns the state as it is.
        """
        if p_WQ is None or not np.isfinite(stamp) or not np.all(np.isfinite(p_WQ)) or stamp <= state.stamp:
            return state
        p_WQ = np.asarray(p_WQ, dtype=float)
        restart = stamp - state.stamp > self.restart_after
        started = stamp if restart else state.started
        growth = state.growth.forget() if restart else state.growth
        horizontal = self._horizontal.update(state.horizontal, stamp, p_WQ[:2])
        vertical = self._vertical.update(state.vertical, stamp, p_WQ[2:])
        vx, vy = horizontal.v
        heading = np.arctan2(vy, vx) if np.hypot(vx, vy) >= self.min_speed else state.heading
        ready = stamp - started >= self.ready_after - 1e-9
        if ready:
            later, _, _ = self._horizontal.predict(horizontal, stamp + HORIZON)
            growth = growth.update(stamp, horizontal.x, later)
        return CartesianState(float(stamp), horizontal, vertical, float(started), float(heading), bool(ready), growth)

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] at absolute ``times`` [s], shape (n, 4).

        yaw is the velocity's direction, continuous along the rows, held where the speed is below ``min_speed``.
        """
        times = np.asarray(times, dtype=float)
        if not np.isfinite(state.stamp):
            return np.zeros((len(times), 4))
        xy, v, _ = self._horizontal.predict(state.horizontal, times[:, None])
        z, _, _ = self._vertical.predict(state.vertical, times[:, None])
        fast = np.hypot(v[:, 0], v[:, 1]) >= self.min_speed
        yaw = np.where(fast, np.arctan2(v[:, 1], v[:, 0]), state.heading)
        # A row that is slow takes the yaw of the last fast one before it.
        index = np.maximum.accumulate(np.where(fast, np.arange(len(times)), 0)) if len(times) else []
        return np.column_stack([xy, z, np.unwrap(yaw[index])])

    def predict_std(self, state, times):
        """Returns the expected horizontal error [m] at absolute ``times`` [s], shape (n,)."""
        horizon = np.asarray(times, dtype=float) - (state.stamp if np.isfinite(state.stamp) else 0.0)
        return state.growth.std(horizon, self.systematic_std)
