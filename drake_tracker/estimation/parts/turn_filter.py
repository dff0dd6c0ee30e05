"""The coordinated-turn filter: an extended Kalman filter of an object that moves along an arc.

Its state is position, heading, speed and curvature. A piece of path with constant curvature at constant speed is
predicted exactly, so the model fits a track of straights and bends and is wrong only where one becomes the other. The
turn rate is curvature times speed. With the turn rate itself as state, as in Bar-Shalom, Li and Kirubarajan, Estimation
with Applications to Tracking and Navigation (2001), section 11.7, an object that stops would keep turning. The speed is
a random walk in time, the curvature a random walk in distance travelled. The speed may be negative: an object that
backs up keeps its heading.
"""

import math
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.config import CoordinatedTurn
from drake_tracker.estimation.parameters import check_positive, check_settings
from drake_tracker.estimation.parts.motions import CHANGE_TIME
from drake_tracker.estimation.parts.std_calibration import (
    HORIZON,
    StdCalibration,
    adapted_climb_noise,
    adapted_speed_noise,
    update_drift,
)
from drake_tracker.estimation.parts.turn_model import (
    CURVATURE,
    HEADING,
    SIGMA_LIMITS,
    SPEED,
    START_POINTS,
    Row,
    X,
    Y,
    along_a_line,
    correct,
    first_estimate,
    height_step,
    near_a_line,
    normalized_lead,
    position_variances,
    propagate,
    turned_about,
    updated_sigma,
)

OUTLIER_DISTANCE = 0.005
"""A point is an outlier when it is farther from its expected position than this [m] plus six standard deviations."""
JUMP_COUNT = 6
"""Number of consecutive outliers, 0.1 s at 60 Hz, after which the object is taken to have jumped."""
STD_NODES = 12
"""Number of times at which `predict_std` is computed; it is interpolated when more are asked for."""
MIN_SPEED = 0.02
"""The random walk of the curvature proceeds at this speed at least, so that a rest does not freeze it [m/s]."""
FRONT_DISTANCE = 0.05
"""Distance after which the front of an object is known [m]. An object at rest gets a random heading. If the object then
backs up this far, the heading pointed to its rear."""


@dataclass(frozen=True)
class TurnFilterState(FrozenState):
    """State of a `TurnFilter` (arrays are read-only).

    Attributes:
        stamp: capture time of the newest point [s].
        mean: the elements `X` ... `CURVATURE`, shape (5,).
        covariance: their covariance, shape (5, 5).
        height: z [m] and climb [m/s], shape (2,).
        height_covariance: their covariance, shape (2, 2).
        sigma: estimated noise of a point, per axis [m].
        start: the first points, rows (stamp, x, y, z); None once the filter runs.
        since: capture time of the first point [s].
        ready: whether there is enough data for a prediction.
        coverage: the scale of `predict_std`.
        drift: how far the newest points lie ahead of their expected positions, see `drift.update_drift`.
        climb_drift: the same for the height, above it.
        outliers: number of newest points that were ignored as outliers.
        distance: distance travelled along the heading since the start, up to `FRONT_DISTANCE` [m].
    """

    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    height: np.ndarray
    height_covariance: np.ndarray
    sigma: float
    start: tuple[Row, ...] | None
    since: float
    ready: bool
    coverage: StdCalibration = StdCalibration()
    drift: float = 0.0
    climb_drift: float = 0.0
    outliers: int = 0
    distance: float = 0.0


class TurnFilter:
    """An `Estimator` of an object that moves along an arc of slowly changing speed and curvature.

    Args:
        settings: see `CoordinatedTurn`. The noises are standard deviations of the change in one second or one metre.
        climb_noise: process noise of the climb [m/s/sqrt(s)].

    Raises:
        DrakeTrackerError: a parameter is out of range.
    """

    def __init__(self, settings: CoordinatedTurn = CoordinatedTurn(), *, climb_noise: float = 0.005) -> None:
        check_settings(settings, CoordinatedTurn, zero_allowed=("ready_after",))
        check_positive("coordinated_turn", climb_noise=climb_noise)
        self.settings = settings
        self.climb_noise = climb_noise

    def initial_state(self) -> TurnFilterState:
        """Returns the state before the first point."""
        return TurnFilterState(
            stamp=-math.inf,
            mean=read_only(np.zeros(5)),
            covariance=read_only(np.eye(5)),
            height=read_only(np.zeros(2)),
            height_covariance=read_only(np.eye(2)),
            sigma=self.settings.start_sigma,
            start=(),
            since=math.inf,
            ready=False,
        )

    def forget(self, state: TurnFilterState) -> TurnFilterState:
        """Returns a fresh state that keeps only the stamp, position, heading and height."""
        held = read_only(state.mean * [1.0, 1.0, 1.0, 0.0, 0.0])
        return replace(self.initial_state(), stamp=state.stamp, mean=held, height=read_only(state.height * [1.0, 0.0]))

    def with_speed(self, state: TurnFilterState, gain: float, std: float) -> TurnFilterState:
        """Returns the state of an object that has just changed its speed.

        Args:
            state: the state before.
            gain: change of the speed [m/s].
            std: standard deviation of the new speed [m/s].
        """
        mean, covariance = np.array(state.mean), np.array(state.covariance)
        mean[SPEED] += gain
        covariance[SPEED, :] = covariance[:, SPEED] = 0.0
        covariance[SPEED, SPEED] = std**2
        along = gain * CHANGE_TIME * np.array([math.cos(mean[HEADING]), math.sin(mean[HEADING])])
        covariance[: Y + 1, : Y + 1] += np.outer(along, along)
        return replace(state, mean=read_only(mean), covariance=read_only(covariance), drift=0.0)

    def restarted(self, state: TurnFilterState, rows: np.ndarray) -> TurnFilterState:
        """Returns the state of an object that has just begun to move along the line through its newest points.

        Args:
            state: the state before; its height goes on, and its noise and what it learned of its errors are kept.
            rows: the points since then (stamp [s], x, y, z [m]), oldest first, shape (n, 4), at least two.
        """
        mean, covariance = along_a_line(rows, state.sigma)
        stamp, height, height_covariance = state.stamp, state.height, state.height_covariance
        for later, _, _, z in rows.tolist():
            height, height_covariance = height_step(
                height, height_covariance, z, later - stamp, self.climb_noise**2, state.sigma**2
            )
            stamp = later
        return replace(
            state,
            stamp=stamp,
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            start=None,
            coverage=state.coverage.forget(),
            drift=0.0,
            outliers=0,
            distance=FRONT_DISTANCE,
        )

    def with_noise_below(self, state: TurnFilterState, sigma: float) -> TurnFilterState:
        """Returns a state that assumes at most a noise ``sigma`` per axis [m]."""
        sigma = max(sigma, SIGMA_LIMITS[0])
        return state if state.sigma <= sigma else replace(state, sigma=sigma)

    def ready(self, state: TurnFilterState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return state.ready

    def update(self, state: TurnFilterState, stamp: float, p_WQ: np.ndarray | None) -> TurnFilterState:
        """Returns the state after a point, see `Estimator.update`.

        A point that is None, not finite, or not newer than the state leaves the state as it is. An outlier (see
        `OUTLIER_DISTANCE`) only advances the state in time; after `JUMP_COUNT` consecutive ones the filter restarts.
        """
        if p_WQ is None or not math.isfinite(stamp) or stamp <= state.stamp:
            return state
        x, y, z = np.asarray(p_WQ, dtype=float).tolist()
        if not math.isfinite(x + y + z):
            return state
        stamp = float(stamp)
        row = (stamp, x, y, z)
        dt = stamp - state.stamp
        # Between two points the object may turn by up to half a turn; a larger turn is ambiguous.
        if dt > self.settings.restart_after or abs(state.mean[SPEED] * state.mean[CURVATURE]) * dt > math.pi:
            return self._restart(state, row)
        if state.start is not None:
            return self._start(state, state.start, row)
        speed_noise = adapted_speed_noise(state.drift, self.settings.speed_noise)
        mean, covariance = self.propagate(state.mean, state.covariance, dt, speed_noise)
        variance = state.sigma**2
        std = math.sqrt(variance + max(covariance[X, X], covariance[Y, Y]))
        if math.hypot(x - mean[X], y - mean[Y]) > OUTLIER_DISTANCE + 6.0 * std:
            return self._skip_outlier(state, row, mean, covariance)
        drift = update_drift(state.drift, normalized_lead(mean, covariance, x, y, variance), dt)
        mean, covariance, residual, trace = correct(mean, covariance, np.array([x, y]), variance)
        if min(covariance[X, X], covariance[Y, Y]) <= 0.0:  # the heading was so uncertain that rounding errors remain
            return self._restart(state, row)
        distance = state.distance
        if distance < FRONT_DISTANCE:
            c, s = math.cos(mean[HEADING]), math.sin(mean[HEADING])
            distance += c * (mean[X] - state.mean[X]) + s * (mean[Y] - state.mean[Y])
            if distance < -FRONT_DISTANCE:
                mean, covariance = turned_about(mean, covariance)
                distance, drift = -distance, -drift
        (a, b), _ = state.height_covariance.tolist()
        height_lead = (z - state.height[0] - dt * state.height[1]) / math.sqrt(a + 2.0 * dt * b + variance)
        climb_drift = update_drift(state.climb_drift, float(height_lead), dt)
        climb_noise = adapted_climb_noise(climb_drift, self.climb_noise)
        height, height_covariance = height_step(state.height, state.height_covariance, z, dt, climb_noise**2, variance)
        sigma = updated_sigma(state.sigma, residual, trace, dt)
        ready = state.ready or stamp - state.since >= self.settings.ready_after
        coverage = state.coverage.judge(stamp, mean[X], mean[Y])
        if ready and coverage.wants(stamp):
            later, spread = self.propagate(mean, covariance, HORIZON, speed_noise)
            coverage = coverage.keep(stamp, later[X], later[Y], math.sqrt(spread[X, X] + spread[Y, Y]))
        return TurnFilterState(
            stamp=stamp,
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            sigma=sigma,
            start=None,
            since=state.since,
            ready=ready,
            coverage=coverage,
            drift=drift,
            climb_drift=climb_drift,
            distance=distance,
        )

    def _restart(self, state: TurnFilterState, row: Row) -> TurnFilterState:
        """Returns the state of a filter that knows only one point, ``row``, and the scale of its standard deviation."""
        return self._start(replace(state, coverage=state.coverage.forget()), (), row)

    def _skip_outlier(
        self,
        state: TurnFilterState,
        row: Row,
        mean: np.ndarray,
        covariance: np.ndarray,
    ) -> TurnFilterState:
        """Returns the state after an outlier, ``row``: the expected mean and covariance, or a restart after a jump."""
        if state.outliers + 1 >= JUMP_COUNT:
            return self._restart(state, row)
        stamp, _, _, z = row
        height, height_covariance = height_step(
            state.height, state.height_covariance, z, stamp - state.stamp, self.climb_noise**2, math.inf
        )
        return replace(
            state,
            stamp=stamp,
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            outliers=state.outliers + 1,
        )

    def propagate(
        self, mean: np.ndarray, covariance: np.ndarray, dt: float, speed_noise: float | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns mean and covariance of the state after a time of any length, in one step.

        Args:
            mean: shape (5,).
            covariance: shape (5, 5).
            dt: the time, zero or more [s].
            speed_noise: process noise of the speed [m/s/sqrt(s)]; None: that of the settings.
        """
        return propagate(mean, covariance, dt, *self._process_noise(mean, speed_noise))

    def _process_noise(self, mean: np.ndarray, speed_noise: float | None) -> tuple[float, float]:
        """Returns the growth of the variances of speed [m^2/s^3] and curvature [1/m^2/s], see `propagate`."""
        q_speed = (self.settings.speed_noise if speed_noise is None else speed_noise) ** 2
        return q_speed, self.settings.bend_noise**2 * max(abs(mean[SPEED].item()), MIN_SPEED)

    def _start(
        self,
        state: TurnFilterState,
        start: tuple[Row, ...],
        row: Row,
    ) -> TurnFilterState:
        """Collects the first points, and fits a straight line through them once enough inliers are known."""
        start, outliers = (*start, row), 0
        sigma = state.sigma
        if len(start) >= START_POINTS:
            near = near_a_line(np.array(start), OUTLIER_DISTANCE + 6.0 * sigma)
            outliers = 0 if near[-1] else state.outliers + 1
            if outliers >= JUMP_COUNT:
                return self._restart(state, row)
            start = tuple(compress(start, near))
        rows = np.array(start)
        mean, covariance = first_estimate(rows, sigma, state.mean[HEADING])
        height, height_covariance = np.array([rows[:, 3].mean(), 0.0]), np.diag([sigma**2, 1e-4])
        return TurnFilterState(
            stamp=row[0],
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            sigma=sigma,
            start=None if len(rows) >= START_POINTS else start,
            since=float(rows[0, 0]),
            ready=False,
            coverage=state.coverage,
            outliers=outliers,
        )

    def predict(self, state: TurnFilterState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad], which is the heading."""
        tau = np.asarray(times, dtype=float) - (state.stamp if math.isfinite(state.stamp) else 0.0)
        x, y, heading, speed, curvature = state.mean
        half = 0.5 * curvature * speed * tau
        chord = speed * tau * np.sinc(half / np.pi)
        rows = np.empty((len(tau), 4))
        rows[:, 0] = x + chord * np.cos(heading + half)
        rows[:, 1] = y + chord * np.sin(heading + half)
        rows[:, 2] = state.height[0] + tau * state.height[1]
        rows[:, 3] = heading + 2.0 * half
        return rows

    def predict_std(self, state: TurnFilterState, times: ArrayLike) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]; 68 % of the errors lie within it."""
        tau = np.asarray(times, dtype=float) - (state.stamp if math.isfinite(state.stamp) else 0.0)
        tau = np.maximum(tau, 0.0)
        # The standard deviation grows smoothly, so a few times are enough.
        nodes = tau if len(tau) <= STD_NODES else np.linspace(tau.min(), tau.max(), STD_NODES)
        speed_noise = adapted_speed_noise(state.drift, self.settings.speed_noise)
        noise = self._process_noise(state.mean, speed_noise)
        variances = position_variances(state.mean, state.covariance, nodes.tolist(), *noise)
        std = np.sqrt(np.maximum(variances, 0.0))
        if nodes is not tau:  # over the square of the time it is nearly straight
            std = np.interp(tau**2, nodes**2, std)
        return np.hypot(state.coverage.factor * std, self.settings.systematic_std)
