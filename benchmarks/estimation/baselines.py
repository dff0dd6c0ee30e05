"""Filters that nobody here wrote, behind the interface of the estimators: Stone Soup's and filterpy's.

Constant velocity, constant acceleration and constant turn, each with its library's own equations; filterpy has an
extended Kalman filter but no model of a turn, so that its turn's function and Jacobian are written here. They filter x
and y; the height is that of the newest point. All are told the true noise of a point, which the estimators of this
project have to find out. The process noise is a spectral density: of acceleration [m^2/s^3], of jerk [m^2/s^5], or of
acceleration and turn rate [rad^2/s^3]; `tune.py` chooses it.
"""

import math
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import ExtendedKalmanFilter
from filterpy.kalman import predict as kalman_predict
from filterpy.kalman import update as kalman_update
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantAcceleration,
    ConstantVelocity,
)
from stonesoup.models.transition.nonlinear import ConstantTurn
from stonesoup.predictor.kalman import ExtendedKalmanPredictor, KalmanPredictor
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import KalmanUpdater

START_POINTS = 8
"""Points through which the first straight line is laid, as `coordinated_turn` does."""
READY_AFTER = 0.3
"""Time span of points [s] needed for a prediction, likewise."""
EPOCH = datetime(1991, 1, 1)
SIZES = {"velocity": 4, "acceleration": 6, "turn": 5}
"""Length of a state: (x, vx, y, vy), (x, vx, ax, y, vy, ay), (x, vx, y, vy, turn rate) [m, s, rad]."""
PLACES = {"velocity": (0, 2), "acceleration": (0, 3), "turn": (0, 2)}
START_STD = {"acceleration": 0.2, "turn": 1.0}
"""What is supposed of the third derivative at first: 0.2 m/s^2, or 1 rad/s."""


@dataclass(frozen=True)
class BaselineState:
    """stamp: of the newest point [s]. height: [m]. first: the first points, rows (stamp, x, y); None once the filter
    runs. since: stamp of the first point [s]. estimate: the library's own state, or (mean, covariance)."""

    stamp: float = -math.inf
    height: float = 0.0
    first: tuple | None = ()
    since: float = math.inf
    estimate: object = None


class Baseline:
    """What the libraries' filters share: the start, and rows of a prediction. ``model`` is of `SIZES`."""

    def __init__(self, model, sigma):
        self.model, self.sigma, self.size, self.places = model, sigma, SIZES[model], PLACES[model]

    def initial_state(self):
        return BaselineState()

    def ready(self, state):
        return state.first is None and state.stamp - state.since >= READY_AFTER

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ (3,) [m, W] captured at ``stamp`` [s]."""
        if p_WQ is None or stamp <= state.stamp:
            return state
        x, y, z = (float(value) for value in p_WQ)
        since = min(state.since, stamp)
        if state.first is None:
            estimate = self._step(state.estimate, state.stamp, stamp, (x, y))
            return BaselineState(stamp, z, None, since, estimate)
        first = (*state.first, (stamp, x, y))
        if len(first) < START_POINTS:
            return BaselineState(stamp, z, first, since)
        return BaselineState(stamp, z, None, since, self._begin(stamp, *self._line(np.array(first))))

    def _line(self, rows):
        """Returns mean and covariance of a straight line through the first points, at the last of them."""
        age = rows[:, 0] - rows[-1, 0]
        slope, place = np.polyfit(age, rows[:, 1:], 1)
        mean, variance = np.zeros(self.size), np.full(self.size, START_STD.get(self.model, 0.0) ** 2)
        for axis, index in enumerate(self.places):
            mean[index], mean[index + 1] = place[axis], slope[axis]
            variance[index] = 4.0 * self.sigma**2 / len(rows)
            variance[index + 1] = self.sigma**2 / np.sum((age - age.mean()) ** 2)
        return mean, np.diag(variance)

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] at absolute ``times`` [s], shape (n, 4); yaw is the velocity's."""
        rows = np.zeros((len(times), 4))
        rows[:, 2] = state.height
        if state.first is None:
            i, j = self.places
            for row, time in zip(rows, times):
                mean = self._ahead(state.estimate, time - state.stamp)
                row[:2], row[3] = (mean[i], mean[j]), math.atan2(mean[j + 1], mean[i + 1])
        return rows


class StoneSoup(Baseline):
    """A Kalman filter of Stone Soup; the turn with its extended one and its `ConstantTurn`."""

    def __init__(self, model, sigma, noise, turn_noise=0.0):
        super().__init__(model, sigma)
        if model == "turn":
            self._motion = ConstantTurn(np.array([noise, noise]), turn_noise)
            self._predictor = ExtendedKalmanPredictor(self._motion)
        else:
            kind = ConstantVelocity if model == "velocity" else ConstantAcceleration
            self._motion = CombinedLinearGaussianTransitionModel([kind(noise), kind(noise)])
            self._predictor = KalmanPredictor(self._motion)
        # Left to itself the turn's covariance loses its symmetry, and drifts within ten seconds.
        self._updater = KalmanUpdater(
            LinearGaussian(self.size, self.places, sigma**2 * np.eye(2)), force_symmetric_covariance=True
        )

    def _begin(self, stamp, mean, covariance):
        return GaussianState(mean[:, None], covariance, timestamp=EPOCH + timedelta(seconds=stamp))

    def _step(self, estimate, before, stamp, point):
        now = EPOCH + timedelta(seconds=stamp)
        prediction = self._predictor.predict(estimate, timestamp=now)
        return self._updater.update(SingleHypothesis(prediction, Detection(np.array(point)[:, None], timestamp=now)))

    def _ahead(self, estimate, step):
        later = self._motion.function(estimate, noise=False, time_interval=timedelta(seconds=step))
        return np.asarray(later, dtype=float)[:, 0]


class Filterpy(Baseline):
    """A Kalman filter of filterpy; the turn with its extended one."""

    def __init__(self, model, sigma, noise, turn_noise=0.0):
        super().__init__(model, sigma)
        self._noise, self._turn_noise = noise, turn_noise
        self._measured = np.zeros((2, self.size))
        self._measured[[0, 1], self.places] = 1.0
        self._variance = sigma**2 * np.eye(2)

    def _begin(self, stamp, mean, covariance):
        return mean, covariance

    def _process_noise(self, step):
        if self.model != "turn":
            return Q_continuous_white_noise(self.size // 2, step, self._noise, block_size=2)
        noise = np.zeros((5, 5))
        noise[:4, :4] = Q_continuous_white_noise(2, step, self._noise, block_size=2)
        noise[4, 4] = self._turn_noise * step
        return noise

    def _step(self, estimate, before, stamp, point):
        mean, covariance = estimate
        step = stamp - before
        if self.model != "turn":
            mean, covariance = kalman_predict(mean, covariance, self._transition(step), self._process_noise(step))
            return kalman_update(mean, covariance, np.array(point), self._variance, self._measured)
        ekf = _TurnFilter(step)
        ekf.x, ekf.P, ekf.F, ekf.R = mean, covariance, turn_jacobian(mean, step), self._variance
        ekf.Q = self._process_noise(step)
        ekf.predict()
        ekf.update(np.array(point), lambda _: self._measured, lambda x: self._measured @ x)
        return ekf.x, ekf.P

    def _transition(self, step):
        block = np.array([[1.0, step, 0.5 * step**2], [0.0, 1.0, step], [0.0, 0.0, 1.0]])
        n = self.size // 2
        return np.kron(np.eye(2), block[:n, :n])

    def _ahead(self, estimate, step):
        return turn(estimate[0], step) if self.model == "turn" else self._transition(step) @ estimate[0]


class _TurnFilter(ExtendedKalmanFilter):
    def __init__(self, step):
        super().__init__(5, 2)
        self._interval = step

    def predict_x(self, u=0):
        self.x = turn(self.x, self._interval)


def turn(mean, step):
    """Returns the state (5,) of the turn ``step`` [s] later (Bar-Shalom, Li and Kirubarajan 2001, section 11.7)."""
    x, vx, y, vy, rate = mean
    angle = rate * step
    sine, versine = (math.sin(angle) / rate, (1.0 - math.cos(angle)) / rate) if abs(angle) > 1e-9 else (step, 0.0)
    c, s = math.cos(angle), math.sin(angle)
    place = x + sine * vx - versine * vy, y + versine * vx + sine * vy
    return np.array([place[0], c * vx - s * vy, place[1], s * vx + c * vy, rate])


def turn_jacobian(mean, step):
    """Returns the Jacobian (5, 5) of `turn`, by central differences."""
    jacobian = np.empty((5, 5))
    for k in range(5):
        reach = np.zeros(5)
        reach[k] = 1e-5
        jacobian[:, k] = (turn(mean + reach, step) - turn(mean - reach, step)) / 2e-5
    return jacobian
