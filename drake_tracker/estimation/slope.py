"""A ball that rolls down an inclined board (Nashman and Chaconas 1990, section 5), followed and predicted to its exit.

The board's frame B has its origin on the face at the middle of the bottom edge, y_B up the slope and z_B outward; x_B
is level. A hollow sphere (inertia I = 2/3 m r^2) that rolls without slipping is driven by gravity and held back by the
rim's inertia: m a = m g sin(incline) - I a / r^2, so that it accelerates by a = 3/5 g sin(incline) down the slope.

Pegs are not known. One that the ball hits is noticed afterwards, by a point far from where it was expected; nothing
says where it will be hit next. The text's two checks of a point stand before the filter: it must lie on the board, and
not be farther from the last one than a ball can have rolled.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_tracker.core.constants import GRAVITY
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import read_only
from drake_tracker.estimation.parameters import not_negative, positive

STEEPEST = 1.5
"""A ball is no faster than this times a free roll over the board's whole length."""
REJECTS = 2
"""So many points in a row that fail a check are believed: the ball is elsewhere."""
SLOWEST_EXIT = 0.05
"""Crossing speeds below this [m/s] say nothing of the time."""


class Exit(NamedTuple):
    """Where and when the ball's centre crosses y_B = 0: ``time`` [s], ``p_WQ`` (3,) [m], ``x`` [m] along x_B, ``speed``
    [m/s] down the slope, and the standard deviations of x [m] and time [s]."""

    time: float
    p_WQ: np.ndarray
    x: float
    speed: float
    std_x: float
    std_time: float


@dataclass(frozen=True)
class SlopeState:
    """What the filter remembers (arrays are read-only).

    stamp: time of the newest point [s]. mean (4,), covariance (4, 4): of x, y [m], vx, vy [m/s] in B. anchor (x, y):
    the place that the ball has not left by more than ``start_distance`` since ``anchored`` [s]; at rest it is the mean
    of so many ``points``. moving: whether it rolls. rejected: points in a row that failed a check.
    """

    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    anchor: np.ndarray
    anchored: float
    points: int = 0
    moving: bool = False
    rejected: int = 0

    def __deepcopy__(self, memo):
        return self


class Slope:
    """The estimator; functional, all memory is in the `SlopeState` that `update` returns.

    Args:
        X_WB: pose of the board, 4 x 4 or the 12 numbers of its upper rows. width, length: of its face [m].
        ball_radius: [m]. walls: whether walls stand along the sides. rolling_factor: of g sin(incline).
        sigma: noise of a point [m, per axis].
        process_noise: of the velocity, white [m/s/sqrt(s)]: what deflects the ball a little.
        hit_speed: change of velocity [m/s, per axis] that a peg may cause.
        gate: a point farther than this from where it was expected, in standard deviations, tells of a hit.
        restitution: of the walls. margin: by how much a point may lie outside of the board [m].
        start_distance: way [m] after which the ball has moved. rest_time: time [s] without, after which it is at rest.
        restart_after: a gap between points [s] after which the filter starts afresh.

    Raises DrakeTrackerError for a board that is level or upside down, or a number that is not positive.
    """

    def __init__(
        self,
        *,
        X_WB,
        width=0.60,
        length=0.90,
        ball_radius=0.020,
        walls=True,
        rolling_factor=0.6,
        sigma=0.0025,
        process_noise=0.03,
        hit_speed=0.4,
        gate=3.5,
        restitution=0.5,
        margin=0.03,
        start_distance=0.012,
        rest_time=0.4,
        restart_after=0.5,
    ):
        positive("slope", width=width, length=length, ball_radius=ball_radius, rolling_factor=rolling_factor)
        positive("slope", sigma=sigma, process_noise=process_noise, hit_speed=hit_speed, gate=gate)
        positive("slope", start_distance=start_distance, rest_time=rest_time, restart_after=restart_after)
        not_negative("slope", restitution=restitution, margin=margin)
        if not (0.0 <= restitution <= 1.0 and width > 2.0 * ball_radius):
            raise DrakeTrackerError("slope: restitution must be from 0 to 1, and the board wider than the ball")
        X_WB = np.asarray(X_WB, dtype=float)
        if X_WB.size not in (12, 16) or not np.all(np.isfinite(X_WB)):
            raise DrakeTrackerError("slope: X_WB must be 4 x 4 numbers, or the 12 of its upper three rows")
        X_WB = X_WB.reshape(-1, 4)[:3]
        self.R_WB, self.p_WB = read_only(X_WB[:, :3].copy()), read_only(X_WB[:, 3].copy())
        if not (self.R_WB[2, 1] > 1e-3 and self.R_WB[2, 2] > 1e-3):
            raise DrakeTrackerError("slope: X_WB describes a board that does not rise along its y axis")
        self.acceleration = rolling_factor * GRAVITY * self.R_WB[2, 1]
        self.half_width = 0.5 * width - ball_radius if walls else math.inf
        self.limits = (0.5 * width + margin, -margin, length + margin)
        self.top_speed = STEEPEST * math.sqrt(2.0 * self.acceleration * length)
        self.ball_radius, self.restitution = ball_radius, restitution
        self.sigma, self.process_noise = sigma, process_noise
        self.hit_speed, self.gate = hit_speed, gate
        self.start_distance, self.rest_time, self.restart_after = start_distance, rest_time, restart_after

    def initial_state(self):
        nothing, unknown, place = np.zeros(4), np.eye(4), np.zeros(2)
        return SlopeState(-math.inf, read_only(nothing), read_only(unknown), read_only(place), -math.inf)

    def ready(self, state):
        """Returns whether the ball was seen to roll."""
        return state.moving

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ, shape (3,) [m, W], the ball's centre at ``stamp`` [s].

        A point that is None, not finite, not newer than the newest one or not on the board returns the state as it is.
        """
        if p_WQ is None or not math.isfinite(stamp) or stamp <= state.stamp:
            return state
        point = ((np.asarray(p_WQ, dtype=float) - self.p_WB) @ self.R_WB)[:2]
        side, bottom, top = self.limits
        if not (abs(point[0]) <= side and bottom <= point[1] <= top):
            return state
        dt = stamp - state.stamp
        if dt > self.restart_after:
            return self._rest(stamp, point)
        if np.hypot(*(point - state.mean[:2])) > self.top_speed * dt + 6.0 * self.sigma:
            if state.rejected + 1 < REJECTS:
                return replace(state, rejected=state.rejected + 1)
            return self._rest(stamp, point)
        left = np.hypot(*(point - state.anchor)) > self.start_distance
        if not state.moving and not left:
            return self._stay(state, stamp, point)
        if not state.moving:
            return self._start(state, stamp, point, dt)
        if not left and stamp - state.anchored > self.rest_time:
            return self._rest(stamp, point)
        mean, covariance = self._correct(state, point, dt)
        return replace(
            state,
            stamp=float(stamp),
            mean=read_only(mean),
            covariance=read_only(covariance),
            anchor=read_only(point) if left else state.anchor,
            anchored=float(stamp) if left else state.anchored,
            rejected=0,
        )

    def _rest(self, stamp, point):
        mean = np.array([*point, 0.0, 0.0])
        return SlopeState(
            float(stamp), read_only(mean), read_only(np.eye(4)), read_only(mean[:2].copy()), float(stamp), points=1
        )

    def _stay(self, state, stamp, point):
        """A ball at rest: the mean of its points is where it lies."""
        n = state.points + 1
        place = state.anchor + (point - state.anchor) / n
        mean = read_only(np.array([*place, 0.0, 0.0]))
        return replace(state, stamp=float(stamp), mean=mean, anchor=read_only(place), points=n, rejected=0)

    def _start(self, state, stamp, point, dt):
        """Two points give a velocity: that of the middle between them, to which half a step of rolling is added."""
        velocity = (point - state.anchor) / dt - [0.0, 0.5 * self.acceleration * dt]
        r = self.sigma**2
        covariance = np.kron([[r, r / dt], [r / dt, 2.0 * r / dt**2]], np.eye(2))
        return replace(
            state,
            stamp=float(stamp),
            mean=read_only(np.array([*point, *velocity])),
            covariance=read_only(covariance),
            anchor=read_only(point),
            anchored=float(stamp),
            moving=True,
            rejected=0,
        )

    def _correct(self, state, point, dt):
        """Returns mean and covariance after a point.

        Where it lies outside of the gate something was hit, at any instant since the last point: a burst of noise of
        the velocity over that time, after which the newest points decide.
        """
        for noise in (0.0, self.hit_speed**2 / dt):
            mean, covariance = self.propagate(state.mean, state.covariance, dt, noise)
            residual = point - mean[:2]
            S = covariance[:2, :2] + self.sigma**2 * np.eye(2)
            if residual @ np.linalg.solve(S, residual) <= self.gate**2:
                break
        gain = np.linalg.solve(S, covariance[:2]).T
        covariance = covariance - gain @ covariance[:2]
        return mean + gain @ residual, 0.5 * (covariance + covariance.T)

    def propagate(self, mean, covariance, dt, burst=0.0):
        """Returns mean and covariance in B of a ball that rolls on for ``dt`` [s], reflected by the walls.

        ``burst``: noise of the velocity beside the usual one, its variance per second [m^2/s^3].
        """
        later, turned = self._roll(mean, dt), self._across(mean[0], mean[2], dt)[2]
        F = np.eye(4)
        F[0, 2] = F[1, 3] = dt
        F[0] *= turned
        F[2] *= turned
        Q = (self.process_noise**2 + burst) * np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
        return later, F @ covariance @ F.T + np.kron(Q, np.eye(2))

    def _roll(self, mean, dt):
        """Returns the mean ``dt`` [s] later."""
        x, y, vx, vy = mean.tolist()
        x, vx, _ = self._across(x, vx, dt)
        return np.array([x, y + vy * dt - 0.5 * self.acceleration * dt * dt, vx, vy - self.acceleration * dt])

    def _across(self, x, vx, dt):
        """Returns x, vx after ``dt`` [s], and by what the bounces off the walls have multiplied a small deviation."""
        turned, half = 1.0, self.half_width
        while abs(x + vx * dt) > half and (x + vx * dt) * vx > 0.0:
            wall = math.copysign(half, vx)
            dt -= max((wall - x) / vx, 0.0)
            x, vx, turned = wall, -self.restitution * vx, -self.restitution * turned
            if abs(turned) < 1e-3:
                break
        return x + vx * dt, vx, turned

    def _crossing(self, mean):
        """Returns the time from now [s] until y_B = 0, and the speed there."""
        _, y, _, vy = mean.tolist()
        speed = math.sqrt(max(vy * vy + 2.0 * self.acceleration * max(y, 0.0), 0.0))
        return (vy + speed) / self.acceleration, speed

    def exit(self, state):
        """Returns the `Exit` foreseen, or None while the ball is not known to roll down."""
        if not state.moving or state.mean[1] <= 0.0:
            return None
        dt, speed = self._crossing(state.mean)
        if speed < SLOWEST_EXIT:
            return None
        (x, _, vx, _), P = self.propagate(state.mean, state.covariance, dt)
        # Later by dt' the ball is there, which has gone on sideways meanwhile: dt' = dy / speed.
        k = vx / speed
        std_x = math.sqrt(max(P[0, 0] + 2.0 * k * P[0, 1] + k * k * P[1, 1], 0.0))
        p_WQ = read_only(self.p_WB + self.R_WB @ [x, 0.0, self.ball_radius])
        return Exit(state.stamp + dt, p_WQ, x, speed, std_x, math.sqrt(max(P[1, 1], 0.0)) / speed)

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] of travel at absolute ``times`` [s], shape (n, 4).

        The ball rolls to the bottom edge, bounces off the walls, and falls freely beyond. A ball at rest stays.
        """
        rows = np.zeros((len(times), 4))
        if not math.isfinite(state.stamp):
            return rows
        ahead = np.maximum(np.asarray(times, dtype=float) - state.stamp, 0.0)
        edge = self._crossing(state.mean)[0] if state.moving else math.inf
        down = -self.R_WB[:, 1]
        for row, dt in zip(rows, ahead):
            x, y, vx, vy = state.mean if not state.moving else self._roll(state.mean, min(dt, edge))
            v_WQ = self.R_WB @ [vx, vy, 0.0]
            row[:3] = self.p_WB + self.R_WB @ [x, y, self.ball_radius]
            if dt > edge:
                fall = dt - edge
                row[:3] += v_WQ * fall - [0.0, 0.0, 0.5 * GRAVITY * fall * fall]
            way = v_WQ if np.hypot(*v_WQ[:2]) > SLOWEST_EXIT else down
            row[3] = math.atan2(way[1], way[0])
        rows[:, 3] = np.unwrap(rows[:, 3])
        return rows

    def predict_std(self, state, times):
        """Returns the expected error along the board [m] at absolute ``times`` [s], shape (n,), 68 of 100 within it.

        Of a ball that hits no peg on the way: what pegs will do nobody knows.
        """
        if not state.moving:
            return np.full(len(times), self.sigma)
        found = np.empty(len(times))
        for k, dt in enumerate(np.maximum(np.asarray(times, dtype=float) - state.stamp, 0.0).tolist()):
            _, P = self.propagate(state.mean, state.covariance, dt)
            found[k] = math.sqrt(max(P[0, 0] + P[1, 1], 0.0))
        return found
