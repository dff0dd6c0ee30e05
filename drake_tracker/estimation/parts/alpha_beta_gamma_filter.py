"""The fixed-gain alpha-beta-gamma filter, a steady-state Kalman filter of a point with nearly constant acceleration.

It is the "variant of the Kalman filter" that the authors used before the arc-length filter, and the "fixed gain
alpha-beta-gamma filter" of the trajectory generator (Allen et al. 1991, section 4.4). The gains follow from one number,
the tracking index sigma_w T^2 / sigma_n (Kalata 1984, "The tracking index"), with sigma_w the standard deviation of the
change of acceleration per step [m/s^2], T the step [s] and sigma_n the standard deviation of the measurement [m].
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only

MIN_TRACKING_INDEX = 1e-30
"""Smallest tracking index whose gains can be told from zero."""


class AlphaBetaGammaGains(NamedTuple):
    """Gains on the residual r: position + alpha r, velocity + beta r / T, acceleration + gamma r / T^2.

    Note the factor of two: ``gamma`` is the coefficient of r / T^2 itself, beta^2 / (2 alpha). Texts that correct the
    acceleration by gamma' r / (2 T^2) have gamma' = beta^2 / alpha.

    Attributes:
        alpha: gain of the position, a number or an array with one gain per coordinate.
        beta: gain of the velocity, likewise.
        gamma: gain of the acceleration, likewise.
    """

    alpha: Any
    beta: Any
    gamma: Any


def alpha_beta_gamma_gains(tracking_index: float) -> AlphaBetaGammaGains:
    """Returns the steady-state gains of a tracking index.

    With q = sqrt(1 - alpha) Kalata's relations beta = 2 (2 - alpha) - 4 q = 2 (1 - q)^2, gamma = beta^2 / (2 alpha) and
    index = gamma / q become the cubic q^3 + (index/2 - 3) q^2 + (index/2 + 3) q - 1 = 0, with one root in (0, 1).

    Args:
        tracking_index: dimensionless, at least `MIN_TRACKING_INDEX`.

    Raises:
        DrakeTrackerError: the index is too small or not finite.
    """
    if not MIN_TRACKING_INDEX <= tracking_index < np.inf:
        raise DrakeTrackerError(
            f"alpha_beta_gamma: tracking_index is {tracking_index:g}; it must be {MIN_TRACKING_INDEX:g} or more, "
            "and finite"
        )
    half = 0.5 * tracking_index
    low, high = 0.0, 1.0
    for _ in range(60):  # bisection: at a small index a closed form loses all digits to cancellation
        q = 0.5 * (low + high)
        if (1.0 - q) ** 3 > half * q * (1.0 + q):
            low = q
        else:
            high = q
    alpha = 1.0 - q * q
    beta = 2.0 * (1.0 - q) ** 2
    return AlphaBetaGammaGains(alpha, beta, beta * beta / (2.0 * alpha))


def starting_gains(count: int, steady: AlphaBetaGammaGains) -> AlphaBetaGammaGains:
    """Returns the gains of one of the first measurements.

    Until the steady gains are larger, the gains fit a least-squares parabola through all measurements so far (a
    constant through one measurement, a line through two). A filter that starts with its steady gains rings instead.

    Args:
        count: number of earlier measurements.
        steady: the steady-state gains.
    """
    if count == 0:
        return AlphaBetaGammaGains(1.0, 0.0, 0.0)
    if count == 1:
        return AlphaBetaGammaGains(1.0, 1.0, 0.0)
    n = count
    scale = 1.0 / ((n + 1) * (n + 2) * (n + 3))
    growing = AlphaBetaGammaGains(3 * (3 * n * n + 3 * n + 2) * scale, 18 * (2 * n + 1) * scale, 60 * scale)
    return growing if growing.alpha > steady.alpha else steady


def abg_predict(x: Any, v: Any, a: Any, dt: Any) -> tuple[Any, Any, Any]:
    """Returns position, velocity and acceleration after a time at constant acceleration.

    Args:
        x: position, a number or an array.
        v: velocity, of the same shape.
        a: acceleration, of the same shape.
        dt: time [s], a number or an array that broadcasts with the others.
    """
    return x + dt * v + 0.5 * dt * dt * a, v + dt * a, a


def abg_step(
    x: Any, v: Any, a: Any, measurement: Any, dt: float, gains: AlphaBetaGammaGains, min_dt: float = 0.0
) -> tuple[Any, Any, Any]:
    """Returns position, velocity and acceleration after a time, corrected by a measurement of the position.

    Args:
        x: position, a number or an array.
        v: velocity, of the same shape.
        a: acceleration, of the same shape.
        measurement: measured position, of the same shape; None: predict only.
        dt: time since the last step [s], which may vary. If it is zero or less, only the position is corrected.
        gains: the gains.
        min_dt: velocity and acceleration are corrected as if ``dt`` were at least this long [s]; otherwise the noise of
            two measurements at almost the same time would become a high speed.
    """
    x, v, a = abg_predict(x, v, a, max(dt, 0.0))
    if measurement is None:
        return x, v, a
    residual = measurement - x
    if dt > 0.0:
        dt = max(dt, min_dt)
        v = v + (gains.beta / dt) * residual
        a = a + (gains.gamma / (dt * dt)) * residual
    return x + gains.alpha * residual, v, a


@dataclass(frozen=True)
class AlphaBetaGammaState(FrozenState):
    """State of an `AlphaBetaGammaFilter` (arrays are read-only).

    Attributes:
        time: time of the newest measurement [s].
        count: number of measurements since the start.
        x: position, shape (size,).
        v: velocity, shape (size,).
        a: acceleration, shape (size,).
    """

    time: float
    count: int
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray


class AlphaBetaGammaFilter:
    """An alpha-beta-gamma filter of independent coordinates, with variable steps and least-squares starting gains.

    It is functional: `update` returns a new `AlphaBetaGammaState`; the filter itself never changes.

    Args:
        size: number of coordinates.
        tracking_index: dimensionless, see `alpha_beta_gamma_gains`.
        restart_after: gap between measurements after which the filter restarts [s].
        min_dt: see `abg_step` [s].

    Raises:
        DrakeTrackerError: the tracking index is too small or not finite.
    """

    def __init__(self, size: int, tracking_index: float, *, restart_after: float = 0.5, min_dt: float = 0.0) -> None:
        self.size = size
        self.gains = alpha_beta_gamma_gains(tracking_index)
        self.restart_after = restart_after
        self.min_dt = min_dt

    def initial_state(self) -> AlphaBetaGammaState:
        """Returns the state before the first measurement."""
        zero = read_only(np.zeros(self.size))
        return AlphaBetaGammaState(time=0.0, count=0, x=zero, v=zero, a=zero)

    def update(self, state: AlphaBetaGammaState, time: float, measurement: np.ndarray | None) -> AlphaBetaGammaState:
        """Returns the state after a measurement.

        A measurement that is None, not finite, or not newer than the state leaves the state as it is.

        Args:
            state: the state before.
            time: time of the measurement [s].
            measurement: measured position, shape (size,).
        """
        if measurement is None or not np.all(np.isfinite(measurement)) or not np.isfinite(time):
            return state
        measurement = np.asarray(measurement, dtype=float)
        dt = time - state.time
        if state.count and dt <= 0.0:
            return state
        if not state.count or dt > self.restart_after:
            zero = np.zeros(self.size)
            x, v, a, count = measurement.copy(), zero, zero.copy(), 0
        else:
            gains = starting_gains(state.count, self.gains)
            x, v, a = abg_step(state.x, state.v, state.a, measurement, dt, gains, self.min_dt)
            count = state.count
        return AlphaBetaGammaState(float(time), count + 1, read_only(x), read_only(v), read_only(a))

    def predict(self, state: AlphaBetaGammaState, time: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns position, velocity and acceleration at a time.

        Args:
            state: the state to predict from.
            time: absolute time [s], before or after that of the state; a number, or an array of shape (n, 1) for rows.
        """
        return abg_predict(state.x, state.v, state.a, time - state.time)
