"""The fixed-gain alpha-beta-gamma filter, a steady-state Kalman filter for a point with nearly constant acceleration.

It is the "variant of the Kalman filter" that the authors used before the arc-length filter, and the "fixed gain
alpha-beta-gamma filter" of the trajectory generator (Allen et al. 1991, section 4.4).  The gains follow from one
number, the tracking index sigma_w T^2 / sigma_n (Kalata 1984, "The tracking index"), with sigma_w the standard
deviation of the change of acceleration per step [m/s^2], T the step [s] and sigma_n that of the measurement [m].
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import read_only

LEAST_INDEX = 1e-30
"""Smallest tracking index whose gains are told from none."""


class AlphaBetaGammaGains(NamedTuple):
    """Gains on the residual r: position + alpha r, velocity + beta r / T, acceleration + gamma r / T^2.

    Mind the factor of two: ``gamma`` is the coefficient of r / T^2 itself, beta^2 / (2 alpha).  Texts that correct the
    acceleration by gamma' r / (2 T^2) have gamma' = beta^2 / alpha.
    """

    alpha: float
    beta: float
    gamma: float


def alpha_beta_gamma_gains(tracking_index):
    """Returns the steady-state gains of a tracking index (> 0, dimensionless).

    With q = sqrt(1 - alpha) Kalata's relations beta = 2 (2 - alpha) - 4 q = 2 (1 - q)^2, gamma = beta^2 / (2 alpha) and
    index = gamma / q become the cubic q^3 + (index/2 - 3) q^2 + (index/2 + 3) q - 1 = 0, with one root in (0, 1).

    Raises DrakeTrackerError when the index is not a finite number of at least `LEAST_INDEX`.
    """
    if not LEAST_INDEX <= tracking_index < np.inf:
        raise DrakeTrackerError(
            f"alpha_beta_gamma: tracking_index is {tracking_index:g}; it must be {LEAST_INDEX:g} or more, and finite"
        )
    half = 0.5 * tracking_index
    low, high = 0.0, 1.0
    for _ in range(60):  # bisection: the cubic's coefficients cancel too much for a closed form at a small index
        q = 0.5 * (low + high)
        if (1.0 - q) ** 3 > half * q * (1.0 + q):
            low = q
        else:
            high = q
    return _gains_from_root(q)


def _gains_from_root(q):
    alpha = 1.0 - q * q
    beta = 2.0 * (1.0 - q) ** 2
    return AlphaBetaGammaGains(alpha, beta, beta * beta / (2.0 * alpha))


def starting_gains(count, steady):
    """Returns the gains of the measurement that follows ``count`` earlier ones.

    They are those of a least-squares parabola through all points so far (of the point, the line, while there are fewer
    than three), until the ``steady`` gains are larger.  A filter started with its steady gains rings instead.
    """
    if count == 0:
        return AlphaBetaGammaGains(1.0, 0.0, 0.0)
    if count == 1:
        return AlphaBetaGammaGains(1.0, 1.0, 0.0)
    n = count
    scale = 1.0 / ((n + 1) * (n + 2) * (n + 3))
    growing = AlphaBetaGammaGains(3 * (3 * n * n + 3 * n + 2) * scale, 18 * (2 * n + 1) * scale, 60 * scale)
    return growing if growing.alpha > steady.alpha else steady


def abg_predict(x, v, a, dt):
    """Returns position, velocity and acceleration ``dt`` [s] later at constant acceleration."""
    return x + dt * v + 0.5 * dt * dt * a, v + dt * a, a


def abg_step(x, v, a, measurement, dt, gains, shortest=0.0):
    """Returns (x, v, a) ``dt`` [s] later, corrected by a measurement of x (scalars or arrays of one shape).

    ``measurement=None`` predicts only.  ``dt`` may differ from step to step; with ``dt`` of zero or less there is no
    rate to learn from the residual, and only the position is corrected.  Of a ``dt`` below ``shortest`` [s] the rates
    are learned as if it were that: noise over next to no time is no speed.
    """
    x, v, a = abg_predict(x, v, a, max(dt, 0.0))
    if measurement is None:
        return x, v, a
    residual = measurement - x
    if dt > 0.0:
        dt = max(dt, shortest)
        v = v + (gains.beta / dt) * residual
        a = a + (gains.gamma / (dt * dt)) * residual
    return x + gains.alpha * residual, v, a


@dataclass(frozen=True)
class AlphaBetaGammaState:
    """State of an `AlphaBetaGammaFilter`: time [s], measurements seen, and x, v, a (read-only arrays of one shape)."""

    time: float
    count: int
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray

    def __deepcopy__(self, memo):
        return self


class AlphaBetaGammaFilter:
    """The filter of a vector of independent coordinates, with variable steps, missing points and a gentle start.

    It is functional: `update` returns a new `AlphaBetaGammaState`, the object itself never changes.
    """

    def __init__(self, size, tracking_index, *, restart_after=0.5, shortest=0.0):
        """``size`` coordinates; a gap of more than ``restart_after`` [s] between measurements starts afresh; for
        ``shortest`` see `abg_step`."""
        self.size = size
        self.gains = alpha_beta_gamma_gains(tracking_index)
        self.restart_after = restart_after
        self.shortest = shortest

    def initial_state(self):
        zero = read_only(np.zeros(self.size))
        return AlphaBetaGammaState(time=0.0, count=0, x=zero, v=zero, a=zero)

    def update(self, state, time, measurement):
        """Returns the state after a measurement, shape (size,), taken at ``time`` [s].

        A measurement that is None, not finite, or not newer than the state leaves the state as it is.
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
            x, v, a = abg_step(state.x, state.v, state.a, measurement, dt, gains, self.shortest)
            count = state.count
        return AlphaBetaGammaState(float(time), count + 1, read_only(x), read_only(v), read_only(a))

    def predict(self, state, time):
        """Returns (x, v, a) at ``time`` [s] (before or after the state's own)."""
        return abg_predict(state.x, state.v, state.a, time - state.time)
