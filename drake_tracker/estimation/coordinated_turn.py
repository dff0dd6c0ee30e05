"""The coordinated-turn filter: an extended Kalman filter of an object that drives, and turns as it drives.

Its state is where the object is, where it heads, how fast it drives and how sharply it bends. A stretch of constant
curvature driven at constant speed is predicted exactly, so that the model matches a track of straights and bends, and
errs where one becomes the other. The turn rate is curvature times speed: kept as the state itself, as in Bar-Shalom, Li
and Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 11.7, it would go on turning an
object that has stopped. Speed wanders with time and curvature with the way driven. Speed may be negative: an object
that backs up keeps its heading.

How much the speed wanders is found out on the way: most objects keep theirs nearly always, and then brake within half
a second. While the filter is right, points lie ahead of what it expects and behind by turns; when they stay on one side
the speed is changing, and the more they do the more its noise is raised (an adjustable level of process noise, ibid.
section 11.2, but by the mean of the innovations: their squares tell of the noise of the points above all).
"""

import math
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.estimation.coverage import HORIZON, Coverage
from drake_tracker.estimation.parameters import not_negative, positive
from drake_tracker.estimation.turn_model import (
    BEND,
    HEADING,
    SPEED,
    X,
    Y,
    ahead,
    correct,
    height_step,
    near_a_line,
    propagate,
    turned_about,
)

START_POINTS = 8
"""Points through which the first straight line is laid."""
SIGMA_LIMITS = (1e-4, 0.02)
"""Smallest and largest noise of a point [m] that is believed."""
JUMP = 0.005
"""A point farther than this [m], and six deviations, from the expected place is wild."""
MOST_WILD = 6
"""So many wild points in a row, 0.1 s at 60 Hz, and the object has jumped; fewer are ignored."""
STD_NODES = 12
"""Times for which `predict_std` is reckoned when it is asked for more."""
SLOWEST = 0.02
"""Curvature wanders with the way driven, at this speed [m/s] at least: a rest does not freeze it."""
DRIFT_TIME = 0.25
"""Time [s] over which points must lie on one side to count as a drift."""
DRIFT_BY_CHANCE = 3.0
"""Square of a drift, in standard deviations, that noise alone is taken to bring about."""
NOISE_OF_DRIFT = 0.03
"""Noise of the speed [m/s/sqrt(s)] for each standard deviation of drift beyond that."""
MOST_SPEED_NOISE = 0.2
"""Likewise, at most: enough for a stop within half a second."""
HEADING_SURE = 0.05
"""Way [m] after which it is known which end of an object is its front. One that was at rest has a heading by chance;
if it then backs up so far, it was the wrong one."""
_SIGMA_TIME = 1.0
"""Time constant of the noise estimate [s]."""


@dataclass(frozen=True)
class CoordinatedTurnState:
    """What the filter remembers (arrays are read-only).

    stamp: time of the newest point [s]. mean (5,), covariance (5, 5): of `X` ... `BEND`. height (2,): z [m] and climb
    [m/s], height_covariance (2, 2). sigma: noise of one point, per axis [m]. start: rows (stamp, x, y, z) of the first
    points, None once the filter runs. since: stamp of the first point [s]. drift: by how much the points of the last
    `DRIFT_TIME` lie ahead of what was expected; of unit variance while the filter is right. wild: how many
    of the newest points were ignored. way: driven along the heading since the start [m], up to `HEADING_SURE`.
    """

    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    height: np.ndarray
    height_covariance: np.ndarray
    sigma: float
    start: tuple | None
    since: float
    ready: bool
    coverage: Coverage = Coverage()
    drift: float = 0.0
    wild: int = 0
    way: float = 0.0

    def __deepcopy__(self, memo):
        return self


class CoordinatedTurn:
    """The estimator; functional, all memory is in the `CoordinatedTurnState` that `update` returns.

    Args:
        speed_noise: how the speed wanders while nothing drifts, standard deviation of its change in a second
            [m/s/sqrt(s)].
        bend_noise: how the curvature wanders, standard deviation of its change in a metre [1/m/sqrt(m)].
        climb_noise: how the climb wanders, as the speed [m/s/sqrt(s)].
        start_sigma: noise of a point [m, per axis] supposed at first.
        systematic_std: error of a point [m] that the filter cannot see, for `predict_std`.
        restart_after: a gap between points [s] after which the filter starts afresh.
        ready_after: time span of points [s] needed for a prediction.
    """

    def __init__(
        self,
        *,
        speed_noise=0.003,
        bend_noise=8.0,
        climb_noise=0.005,
        start_sigma=0.002,
        systematic_std=0.0,
        restart_after=1.0,
        ready_after=0.3,
    ):
        of = "coordinated_turn"
        positive(of, speed_noise=speed_noise, bend_noise=bend_noise, climb_noise=climb_noise, start_sigma=start_sigma)
        positive(of, restart_after=restart_after)
        not_negative(of, systematic_std=systematic_std, ready_after=ready_after)
        self.speed_noise, self.bend_noise, self.climb_noise = speed_noise, bend_noise, climb_noise
        self.start_sigma = start_sigma
        self.systematic_std = systematic_std
        self.restart_after = restart_after
        self.ready_after = ready_after

    def initial_state(self):
        return CoordinatedTurnState(
            stamp=-math.inf,
            mean=read_only(np.zeros(5)),
            covariance=read_only(np.eye(5)),
            height=read_only(np.zeros(2)),
            height_covariance=read_only(np.eye(2)),
            sigma=self.start_sigma,
            start=(),
            since=math.inf,
            ready=False,
        )

    def forget(self, state):
        """Returns the state of a filter that knows of the past no more than when and where, and at what height."""
        held = read_only(state.mean * [1.0, 1.0, 1.0, 0.0, 0.0])
        return replace(self.initial_state(), stamp=state.stamp, mean=held, height=read_only(state.height * [1.0, 0.0]))

    def ready(self, state):
        """Returns whether there is enough data for a prediction."""
        return state.ready

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ, shape (3,) [m, W], captured at ``stamp`` [s].

        A point that is None, not finite, or not newer than the newest one returns the state as it is. A wild one, see
        `JUMP`, is taken for none; after `MOST_WILD` of them in a row the filter begins afresh.
        """
        if p_WQ is None or not math.isfinite(stamp) or stamp <= state.stamp:
            return state
        x, y, z = np.asarray(p_WQ, dtype=float).tolist()
        if not math.isfinite(x + y + z):
            return state
        stamp = float(stamp)
        row = (stamp, x, y, z)
        dt = stamp - state.stamp
        # Between two points it may turn by half a turn; more cannot be told from less.
        if dt > self.restart_after or abs(state.mean[SPEED] * state.mean[BEND]) * dt > math.pi:
            return self._start_afresh(state, row)
        if state.start is not None:
            return self._start(state, state.start, row)
        speed_noise = self._speed_noise_now(state)
        mean, covariance = self.propagate(state.mean, state.covariance, dt, speed_noise)
        variance = state.sigma**2
        deviation = math.sqrt(variance + max(covariance[X, X], covariance[Y, Y]))
        if math.hypot(x - mean[X], y - mean[Y]) > JUMP + 6.0 * deviation:
            return self._ignore(state, row, mean, covariance)
        kept = math.exp(-dt / DRIFT_TIME)
        drift = kept * state.drift + math.sqrt(1.0 - kept * kept) * ahead(mean, covariance, x, y, variance)
        mean, covariance, residual, hph = correct(mean, covariance, np.array([x, y]), variance)
        way = state.way
        if way < HEADING_SURE:
            c, s = math.cos(mean[HEADING]), math.sin(mean[HEADING])
            way += c * (mean[X] - state.mean[X]) + s * (mean[Y] - state.mean[Y])
            if way < -HEADING_SURE:
                mean, covariance = turned_about(mean, covariance)
                way, drift = -way, -drift
        height, height_covariance = self._update_height(state, z, dt, variance)
        # What a corrected state leaves of a residual, plus what the correction took up, is the noise (Mehra 1972).
        measured = 0.5 * (residual @ residual + hph)
        gain = 1.0 - math.exp(-dt / _SIGMA_TIME)
        sigma = math.sqrt(variance + gain * (measured - variance))
        ready = state.ready or stamp - state.since >= self.ready_after
        coverage = state.coverage.judge(stamp, mean[X], mean[Y])
        if ready and coverage.wants(stamp):
            later, spread = self.propagate(mean, covariance, HORIZON, speed_noise)
            coverage = coverage.keep(stamp, later[X], later[Y], math.sqrt(spread[X, X] + spread[Y, Y]))
        return CoordinatedTurnState(
            stamp=stamp,
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            sigma=min(max(sigma, SIGMA_LIMITS[0]), SIGMA_LIMITS[1]),
            start=None,
            since=state.since,
            ready=ready,
            coverage=coverage,
            drift=drift,
            way=way,
        )

    def _start_afresh(self, state, row):
        """Returns the state of a filter that knows ``row`` (stamp, x, y, z) and how its predictions came true."""
        return self._start(replace(state, coverage=state.coverage.forget()), (), row)

    def _ignore(self, state, row, mean, covariance):
        """Returns the state after a wild point, ``row`` as in `CoordinatedTurnState`: the expected ``mean`` and
        ``covariance``, or a fresh start where the object has jumped to."""
        if state.wild + 1 >= MOST_WILD:
            return self._start_afresh(state, row)
        height, height_covariance = self._update_height(state, row[3], row[0] - state.stamp, math.inf)
        return replace(
            state,
            stamp=row[0],
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            wild=state.wild + 1,
        )

    def _speed_noise_now(self, state):
        """Returns how the speed is taken to wander now [m/s/sqrt(s)]."""
        beyond = max(state.drift**2 - DRIFT_BY_CHANCE, 0.0)
        raised = math.sqrt(self.speed_noise**2 + NOISE_OF_DRIFT**2 * beyond)
        return max(min(raised, MOST_SPEED_NOISE), self.speed_noise)

    def propagate(self, mean, covariance, dt, speed_noise=None):
        """Returns mean and covariance of the state ``dt`` [s] later; any dt >= 0 in one step.

        ``speed_noise``: as the parameter, which it is if None [m/s/sqrt(s)].
        """
        q_speed = (self.speed_noise if speed_noise is None else speed_noise) ** 2
        q_bend = self.bend_noise**2 * max(abs(mean[SPEED].item()), SLOWEST)
        return propagate(mean, covariance, dt, q_speed, q_bend)

    def _start(self, state, start, row):
        """Collects the first points; lays a straight line through them once there are enough that are not wild."""
        start, wild = (*start, row), 0
        stamp, _, _, _ = row
        sigma = state.sigma
        if len(start) >= START_POINTS:
            near = near_a_line(np.array(start), JUMP + 6.0 * sigma)
            wild = 0 if near[-1] else state.wild + 1
            if wild >= MOST_WILD:
                return self._start_afresh(state, row)
            start = tuple(compress(start, near))
        rows = np.array(start)
        since = rows[0, 0]
        mean, covariance = np.array([*rows[-1, 1:3], state.mean[HEADING], 0.0, 0.0]), np.eye(5)
        height, height_covariance = np.array([rows[:, 3].mean(), 0.0]), np.diag([sigma**2, 1e-4])
        if len(rows) >= START_POINTS:
            age = rows[:, 0] - stamp
            slope, at_end = np.polyfit(age, rows[:, 1:3], 1)
            spread = np.sum((age - age.mean()) ** 2)
            speed = math.hypot(*slope)
            rate_variance = sigma**2 / spread
            mean = np.array([*at_end, math.atan2(slope[1], slope[0]), speed, 0.0])
            place_variance = 4.0 * sigma**2 / len(rows)
            heading_variance = min(rate_variance / max(speed, 1e-3) ** 2, math.pi**2)
            covariance = np.diag([place_variance, place_variance, heading_variance, rate_variance, 25.0])
            start = None
        return CoordinatedTurnState(
            stamp=stamp,
            mean=read_only(mean),
            covariance=read_only(covariance),
            height=read_only(height),
            height_covariance=read_only(height_covariance),
            sigma=sigma,
            start=start,
            since=float(since),
            ready=False,
            coverage=state.coverage,
            wild=wild,
        )

    def _update_height(self, state, z, dt, variance):
        return height_step(state.height, state.height_covariance, z, dt, self.climb_noise**2, variance)

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] at absolute ``times`` [s], shape (n, 4); yaw is the heading."""
        tau = np.asarray(times, dtype=float) - (state.stamp if math.isfinite(state.stamp) else 0.0)
        x, y, heading, speed, bend = state.mean
        half = 0.5 * bend * speed * tau
        chord = speed * tau * np.sinc(half / np.pi)
        rows = np.empty((len(tau), 4))
        rows[:, 0] = x + chord * np.cos(heading + half)
        rows[:, 1] = y + chord * np.sin(heading + half)
        rows[:, 2] = state.height[0] + tau * state.height[1]
        rows[:, 3] = heading + 2.0 * half
        return rows

    def predict_std(self, state, times):
        """Returns the expected horizontal error [m] at absolute ``times`` [s], shape (n,), 68 of 100 within it."""
        tau = np.asarray(times, dtype=float) - (state.stamp if math.isfinite(state.stamp) else 0.0)
        tau = np.maximum(tau, 0.0)
        # The deviation grows smoothly: a few times tell it for all.
        nodes = tau if len(tau) <= STD_NODES else np.linspace(tau.min(), tau.max(), STD_NODES)
        speed_noise = self._speed_noise_now(state)
        deviations = np.empty(len(nodes))
        for k, step in enumerate(nodes.tolist()):
            _, covariance = self.propagate(state.mean, state.covariance, step, speed_noise)
            deviations[k] = math.sqrt(max(covariance[X, X] + covariance[Y, Y], 0.0))
        if nodes is not tau:  # which over the square of the time is nearly straight
            deviations = np.interp(tau**2, nodes**2, deviations)
        return np.hypot(state.coverage.factor * deviations, self.systematic_std)
