"""The inclined-plane filter: follows a ball that rolls down a board and predicts where and when it leaves the board.

The ball moves as `rolling_ball` describes (Nashman and Chaconas 1990, section 5). The pegs on the board are not known.
A hit is noticed afterwards, by a point far from its expected position; nothing says where the ball will hit next. The
paper's two checks of a point come before the filter: the point must lie on the board, and must not be farther from the
previous one than a ball can have rolled.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.constants import GRAVITY
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.config import InclinedPlane
from drake_tracker.estimation.parameters import check_not_negative, check_positive, check_settings
from drake_tracker.estimation.parts.rolling_ball import RollingBallModel

MAX_SPEED_FACTOR = 1.5
"""A ball is no faster than this factor times the speed of a free roll down the whole board."""
JUMP_COUNT = 2
"""After this many consecutive points that fail a check, the ball is assumed to be at the newest point."""
MIN_EXIT_SPEED = 0.05
"""Slower crossings do not determine the time [m/s]."""


class Exit(NamedTuple):
    """Where and when the ball's centre crosses the bottom edge, y_B = 0.

    Attributes:
        time: absolute time of the crossing [s].
        p_WQ: position of the centre, shape (3,), in W [m].
        x: its x_B [m].
        speed: speed down the slope [m/s].
        std_x: standard deviation of x [m].
        std_time: standard deviation of the time [s].
    """

    time: float
    p_WQ: np.ndarray
    x: float
    speed: float
    std_x: float
    std_time: float


@dataclass(frozen=True)
class InclinedPlaneState(FrozenState):
    """State of a `InclinedPlaneEstimator` (arrays are read-only).

    Attributes:
        stamp: capture time of the newest point [s].
        mean: x, y [m], vx, vy [m/s] in B, shape (4,).
        covariance: their covariance, shape (4, 4).
        anchor: position (x, y)_B that the ball has not left by more than ``start_distance`` [m]; at rest, the mean of
            the points.
        anchored: time since when it has not left the anchor [s].
        points: number of points that the anchor of a ball at rest averages.
        moving: whether the ball rolls.
        rejected: number of newest points that failed a check.
    """

    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    anchor: np.ndarray
    anchored: float
    points: int = 0
    moving: bool = False
    rejected: int = 0


class InclinedPlaneEstimator:
    """An `Estimator` of a ball that rolls down a board.

    Args:
        settings: see `InclinedPlane`.
        X_WB: pose of the board, 4 x 4 or the 12 numbers of its upper rows.
        width: width of the face [m].
        length: length of the face up the slope [m].
        ball_radius: radius of the ball [m].
        walls: whether there are walls along the sides.
        rolling_factor: acceleration of the ball as a fraction of g sin(incline).
        margin: distance beyond the board's edges up to which points are accepted [m].
        start_distance: distance after which the ball counts as moving [m].
        rest_time: time within that distance after which the ball counts as at rest [s].
        restart_after: gap between points after which the filter restarts [s].

    Attributes:
        ball: the `RollingBallModel` on this board.

    Raises:
        DrakeTrackerError: the board is level or upside down, or a parameter is out of range.
    """

    def __init__(
        self,
        settings: InclinedPlane = InclinedPlane(),
        *,
        X_WB: ArrayLike,
        width: float = 0.60,
        length: float = 0.90,
        ball_radius: float = 0.020,
        walls: bool = True,
        rolling_factor: float = 0.6,
        margin: float = 0.03,
        start_distance: float = 0.012,
        rest_time: float = 0.4,
        restart_after: float = 0.5,
    ) -> None:
        check_settings(settings, InclinedPlane)
        check_positive(
            "inclined_plane", width=width, length=length, ball_radius=ball_radius, rolling_factor=rolling_factor
        )
        check_positive(
            "inclined_plane", start_distance=start_distance, rest_time=rest_time, restart_after=restart_after
        )
        check_not_negative("inclined_plane", margin=margin)
        if not (settings.restitution <= 1.0 and width > 2.0 * ball_radius):
            raise DrakeTrackerError(
                "inclined_plane: restitution must be from 0 to 1, and the board wider than the ball"
            )
        X_WB = np.asarray(X_WB, dtype=float)
        if X_WB.size not in (12, 16) or not np.all(np.isfinite(X_WB)):
            raise DrakeTrackerError("inclined_plane: X_WB must be 4 x 4 numbers, or the 12 of its upper three rows")
        X_WB = X_WB.reshape(-1, 4)[:3]
        self.R_WB, self.p_WB = read_only(X_WB[:, :3].copy()), read_only(X_WB[:, 3].copy())
        if not (self.R_WB[2, 1] > 1e-3 and self.R_WB[2, 2] > 1e-3):
            raise DrakeTrackerError("inclined_plane: X_WB describes a board that does not rise along its y axis")
        self.settings = settings
        self.ball_radius = ball_radius
        self.ball = RollingBallModel(
            acceleration=rolling_factor * GRAVITY * self.R_WB[2, 1],
            half_width=0.5 * width - ball_radius if walls else math.inf,
            restitution=settings.restitution,
            process_noise=settings.process_noise,
        )
        self._limits = (0.5 * width + margin, -margin, length + margin)
        self._top_speed = MAX_SPEED_FACTOR * math.sqrt(2.0 * self.ball.acceleration * length)
        self._start_distance, self._rest_time, self._restart_after = start_distance, rest_time, restart_after

    def initial_state(self) -> InclinedPlaneState:
        """Returns the state before the first point."""
        zero, unknown, origin = np.zeros(4), np.eye(4), np.zeros(2)
        return InclinedPlaneState(-math.inf, read_only(zero), read_only(unknown), read_only(origin), -math.inf)

    def ready(self, state: InclinedPlaneState) -> bool:
        """Returns whether the ball has been seen rolling."""
        return state.moving

    def update(self, state: InclinedPlaneState, stamp: float, p_WQ: np.ndarray | None) -> InclinedPlaneState:
        """Returns the state after a point, the centre of the ball; see `Estimator.update`.

        A point that is None, not finite, not newer than the state or not on the board leaves the state as it is.
        """
        if p_WQ is None or not math.isfinite(stamp) or stamp <= state.stamp:
            return state
        point = ((np.asarray(p_WQ, dtype=float) - self.p_WB) @ self.R_WB)[:2]
        side, bottom, top = self._limits
        if not (abs(point[0]) <= side and bottom <= point[1] <= top):
            return state
        dt = stamp - state.stamp
        if dt > self._restart_after:
            return self._rest(stamp, point)
        if np.hypot(*(point - state.mean[:2])) > self._top_speed * dt + 6.0 * self.settings.sigma:
            if state.rejected + 1 < JUMP_COUNT:
                return replace(state, rejected=state.rejected + 1)
            return self._rest(stamp, point)
        left = np.hypot(*(point - state.anchor)) > self._start_distance
        if not state.moving and not left:
            return self._stay(state, stamp, point)
        if not state.moving:
            return self._start(state, stamp, point, dt)
        if not left and stamp - state.anchored > self._rest_time:
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

    def _rest(self, stamp: float, point: np.ndarray) -> InclinedPlaneState:
        """Returns the state of a ball at rest at ``point``, (x, y)_B [m], of which nothing else is known."""
        mean = np.array([*point, 0.0, 0.0])
        return InclinedPlaneState(
            float(stamp), read_only(mean), read_only(np.eye(4)), read_only(mean[:2].copy()), float(stamp), points=1
        )

    def _stay(self, state: InclinedPlaneState, stamp: float, point: np.ndarray) -> InclinedPlaneState:
        """Returns the state of a ball that stays at rest: its position is the mean of its points."""
        n = state.points + 1
        place = state.anchor + (point - state.anchor) / n
        mean = read_only(np.array([*place, 0.0, 0.0]))
        return replace(state, stamp=float(stamp), mean=mean, anchor=read_only(place), points=n, rejected=0)

    def _start(self, state: InclinedPlaneState, stamp: float, point: np.ndarray, dt: float) -> InclinedPlaneState:
        """Returns the state of a ball that begins to roll.

        Two points give the velocity in the middle between them, to which half a step of acceleration is added.
        """
        velocity = (point - state.anchor) / dt - [0.0, 0.5 * self.ball.acceleration * dt]
        r = self.settings.sigma**2
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

    def _correct(self, state: InclinedPlaneState, point: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns mean and covariance after a point.

        A point outside the gate means that the ball hit something, at any time since the last point. The process noise
        of the velocity is then raised over that time, so that the newest points decide.
        """
        for burst in (0.0, self.settings.hit_speed**2 / dt):
            mean, covariance = self.ball.propagate(state.mean, state.covariance, dt, burst)
            residual = point - mean[:2]
            S = covariance[:2, :2] + self.settings.sigma**2 * np.eye(2)
            if residual @ np.linalg.solve(S, residual) <= self.settings.gate**2:
                break
        gain = np.linalg.solve(S, covariance[:2]).T
        covariance = covariance - gain @ covariance[:2]
        return mean + gain @ residual, 0.5 * (covariance + covariance.T)

    def exit(self, state: InclinedPlaneState) -> Exit | None:
        """Returns the predicted crossing of the bottom edge, or None unless the ball rolls down fast enough."""
        if not state.moving or state.mean[1] <= 0.0:
            return None
        dt, speed = self.ball.crossing(state.mean)
        if speed < MIN_EXIT_SPEED:
            return None
        (x, _, vx, _), P = self.ball.propagate(state.mean, state.covariance, dt)
        # An error dy delays the crossing by dy / speed, during which the ball moves sideways.
        k = vx / speed
        std_x = math.sqrt(max(P[0, 0] + 2.0 * k * P[0, 1] + k * k * P[1, 1], 0.0))
        p_WQ = read_only(self.p_WB + self.R_WB @ [x, 0.0, self.ball_radius])
        return Exit(state.stamp + dt, p_WQ, x, speed, std_x, math.sqrt(max(P[1, 1], 0.0)) / speed)

    def predict(self, state: InclinedPlaneState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw of travel [rad].

        The ball rolls to the bottom edge, bounces off the walls, and falls freely beyond. A ball at rest stays.
        """
        times = np.asarray(times, dtype=float)
        rows = np.zeros((len(times), 4))
        if not math.isfinite(state.stamp):
            return rows
        edge = self.ball.crossing(state.mean)[0] if state.moving else math.inf
        down = -self.R_WB[:, 1]
        for row, dt in zip(rows, np.maximum(times - state.stamp, 0.0)):
            x, y, vx, vy = self.ball.roll(state.mean, min(dt, edge)) if state.moving else state.mean
            v_WQ = self.R_WB @ [vx, vy, 0.0]
            row[:3] = self.p_WB + self.R_WB @ [x, y, self.ball_radius]
            if dt > edge:
                fall = dt - edge
                row[:3] += v_WQ * fall - [0.0, 0.0, 0.5 * GRAVITY * fall * fall]
            direction = v_WQ if np.hypot(*v_WQ[:2]) > MIN_EXIT_SPEED else down
            row[3] = math.atan2(direction[1], direction[0])
        rows[:, 3] = np.unwrap(rows[:, 3])
        return rows

    def predict_std(self, state: InclinedPlaneState, times: ArrayLike) -> np.ndarray:
        """Returns the expected error along the board, shape (n,) [m]; 68 % of the errors lie within it.

        It holds for a ball that hits no more pegs; the effect of pegs is unpredictable.
        """
        times = np.asarray(times, dtype=float)
        if not state.moving:
            return np.full(len(times), self.settings.sigma)
        std = np.empty(len(times))
        for k, dt in enumerate(np.maximum(times - state.stamp, 0.0).tolist()):
            _, P = self.ball.propagate(state.mean, state.covariance, dt)
            std[k] = math.sqrt(max(P[0, 0] + P[1, 1], 0.0))
        return std
