"""Position and speed of an object on a known path: three Kalman filters, mixed (an interacting multiple model).

The state of each is arc length, speed and acceleration. The first assumes that the speed hardly changes and becomes
sharp. The second follows a speed that rises and falls gently and extrapolates its change. The third follows an object
that brakes, stops or backs up, whose future acceleration cannot be predicted. The weight of each follows from how well
it predicted the measurements (Blom and Bar-Shalom 1988).
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.estimation.config import PhaseFilterConfig
from drake_tracker.estimation.parameters import check_settings
from drake_tracker.estimation.parts.motions import CHANGE_TIME, Motion, fading_acceleration, white_acceleration

CRUISE, MANOEUVRE, STOP = range(3)
"""The modes: constant speed, gentle change of speed, stopping or starting."""
SOJOURN = (1000.0, 6.0, 1.0)
"""Mean time that an object stays in each mode [s]; it changes to either of the others with equal probability."""
AFTER_CHANGE = 0.01
"""Probability of each of the other modes than constant speed just after a sudden change of speed."""
MIN_PROBABILITY = 1e-9
"""Smallest probability of a mode."""


class Mode(NamedTuple):
    """One filter in plain numbers, which are faster than small arrays.

    Attributes:
        mean: arc length s [m], speed v [m/s], acceleration a [m/s^2].
        covariance: of ss, sv, sa, vv, va, aa.
        probability: probability of the mode.
    """

    mean: tuple[float, float, float]
    covariance: tuple[float, float, float, float, float, float]
    probability: float


Modes = tuple[Mode, ...]
"""The state of a `PhaseFilter`: one mode each for `CRUISE`, `MANOEUVRE`, `STOP`."""


class PhaseFilter:
    """Filters the position of an object along a path; functional, its state is a `Modes` tuple.

    Args:
        settings: see `PhaseFilterConfig`. The noises are standard deviations of the change in one second.

    Raises:
        DrakeTrackerError: a parameter is out of range.
    """

    def __init__(self, settings: PhaseFilterConfig = PhaseFilterConfig()) -> None:
        check_settings(settings, PhaseFilterConfig)
        motions = (
            white_acceleration(settings.cruise_noise**2),
            fading_acceleration(settings.manoeuvre_noise**2, settings.fading),
            fading_acceleration(settings.stop_noise**2, settings.stop_fading),
        )
        # Cached for rounded times, because sums of periods differ in their last digits.
        self._motions: tuple[Callable[[float], Motion], ...] = tuple(
            lru_cache(maxsize=1024)(motion) for motion in motions
        )
        self._cached_arc_lengths = lru_cache(maxsize=64)(self._arc_lengths)

    def start(self, s: float, v: float, s_variance: float, v_variance: float) -> Modes:
        """Returns the modes of an object whose mode is unknown.

        Args:
            s: arc length [m].
            v: speed [m/s].
            s_variance: variance of the arc length [m^2].
            v_variance: variance of the speed [m^2/s^2].
        """
        mode = Mode((float(s), float(v), 0.0), (float(s_variance), 0.0, 0.0, float(v_variance), 0.0, 0.01), 1.0 / 3.0)
        return mode, mode, mode

    def propagate(self, modes: Modes, dt: float) -> Modes:
        """Returns the modes ``dt`` [s] later, mixed according to the probability of a change between them."""
        dt = round(dt, 9)
        return tuple(_move(mode, motion(dt)) for mode, motion in zip(_mix(modes, dt), self._motions, strict=True))

    def correct(self, modes: Modes, s: float, variance: float) -> Modes:
        """Returns the modes after a measured arc length ``s`` [m] with ``variance`` [m^2]."""
        corrected, weights = [], []
        for (ms, mv, ma), (ss, sv, sa, vv, va, aa), probability in modes:
            total = ss + variance
            gs, gv, ga = ss / total, sv / total, sa / total
            residual = s - ms
            likelihood = math.exp(-0.5 * min(residual * residual / total, 200.0)) / math.sqrt(total)
            weights.append(probability * likelihood)
            mean = (ms + gs * residual, mv + gv * residual, ma + ga * residual)
            covariance = (ss - gs * ss, sv - gs * sv, sa - gs * sa, vv - gv * sv, va - gv * sa, aa - ga * sa)
            corrected.append((mean, covariance))
        total = sum(weights)
        return tuple(
            Mode(mean, covariance, min(max(weight / total, MIN_PROBABILITY), 1.0))
            for (mean, covariance), weight in zip(corrected, weights, strict=True)
        )

    @staticmethod
    def with_speed(modes: Modes, gain: float, std: float) -> Modes:
        """Returns the modes of an object that has just changed its speed, which it will now keep.

        Args:
            modes: the modes before.
            gain: change of the speed [m/s].
            std: standard deviation of the new speed [m/s].
        """
        s, variance = mixed_moments(modes)
        variance += (gain * CHANGE_TIME) ** 2
        speed = sum([mode.probability * mode.mean[1] for mode in modes]) + gain
        probabilities = (1.0 - 2.0 * AFTER_CHANGE, AFTER_CHANGE, AFTER_CHANGE)
        return tuple(
            Mode((s, speed, 0.0), (variance, 0.0, 0.0, std**2, 0.0, 0.0), probability) for probability in probabilities
        )

    @staticmethod
    def shift(modes: Modes, distance: float) -> Modes:
        """Returns the modes with ``distance`` [m] added to all arc lengths."""
        return tuple(mode._replace(mean=(mode.mean[0] + distance, *mode.mean[1:])) for mode in modes)

    def predict(self, modes: Modes, taus: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Returns the expected arc lengths [m] and their standard deviations [m], both (n,), of all modes together.

        The standard deviations are averaged, not the variances: an improbable mode does not widen the interval that
        contains 68 % of the errors.

        Args:
            modes: the modes.
            taus: times ahead, shape (n,) [s].
        """
        taus = tuple([round(tau, 9) for tau in np.asarray(taus).tolist()])
        means, stds = [], []
        for mode, (v_to_s, a_to_s, noise) in zip(modes, self._cached_arc_lengths(taus), strict=True):
            (s, v, a), (ss, sv, sa, vv, va, aa), _ = mode
            means.append(s + v_to_s * v + a_to_s * a)
            # As `_move`, but only the arc length, at all times at once.
            ss, sv, sa = ss + v_to_s * sv + a_to_s * sa, sv + v_to_s * vv + a_to_s * va, sa + v_to_s * va + a_to_s * aa
            stds.append(np.sqrt(np.maximum(ss + v_to_s * sv + a_to_s * sa + noise, 0.0)))
        shares = [mode.probability for mode in modes]
        s = sum(share * mean for share, mean in zip(shares, means, strict=True))
        spreads = [share * np.hypot(std, mean - s) for share, std, mean in zip(shares, stds, means, strict=True)]
        return s, sum(spreads)

    def _arc_lengths(self, taus: tuple[float, ...]) -> list[np.ndarray]:
        """Returns, for each mode, (3, n): ``v_to_s``, ``a_to_s`` and the noise of s of its motions over ``taus``."""
        rows = [[(step.v_to_s, step.a_to_s, step.noise[0]) for step in map(motion, taus)] for motion in self._motions]
        return [np.array(columns).reshape(-1, 3).T.copy() for columns in rows]


def mixed_mean(modes: Modes) -> float:
    """Returns the expected arc length of all modes together [m]."""
    return sum([mode.probability * mode.mean[0] for mode in modes])


def mixed_moments(modes: Modes) -> tuple[float, float]:
    """Returns the expected arc length of all modes together [m], and its variance [m^2]."""
    s = mixed_mean(modes)
    return s, sum([mode.probability * (mode.covariance[0] + (mode.mean[0] - s) ** 2) for mode in modes])


def normalized_distance(modes: Modes, s: float, variance: float) -> float:
    """Returns the distance of a measurement from the mode that expected it most, in standard deviations.

    Args:
        modes: the modes.
        s: measured arc length [m].
        variance: of the measurement [m^2].
    """
    return math.sqrt(min([(s - mode.mean[0]) ** 2 / (mode.covariance[0] + variance) for mode in modes]))


def _mix(modes: Modes, dt: float) -> list[Mode]:
    """Returns the modes after mixing: each mode receives its share of the other modes that changed to it in ``dt``
    [s]."""
    leaves = [
        0.5 * mode.probability * (1.0 - math.exp(-dt / sojourn)) for mode, sojourn in zip(modes, SOJOURN, strict=True)
    ]
    mixed = []
    for index, mode in enumerate(modes):
        stays = mode.probability - 2.0 * leaves[index]
        for source, other in enumerate(modes):
            if source != index:
                mode = _blend(mode, other, stays, leaves[source])
                stays = mode.probability
        mixed.append(mode)
    return mixed


def _blend(mode: Mode, other: Mode, stays: float, comes: float) -> Mode:
    """Returns the mean and covariance of two modes together.

    Args:
        mode: a mode.
        other: the mode that is mixed into it.
        stays: probability of ``mode``.
        comes: probability that changes from ``other`` to it.
    """
    (s, v, a), (ss, sv, sa, vv, va, aa), _ = mode
    (other_s, other_v, other_a), (other_ss, other_sv, other_sa, other_vv, other_va, other_aa), _ = other
    share = comes / (stays + comes)
    ds, dv, da, rest = other_s - s, other_v - v, other_a - a, 1.0 - share
    return Mode(
        (s + share * ds, v + share * dv, a + share * da),
        (
            ss + share * (other_ss - ss + rest * ds * ds),
            sv + share * (other_sv - sv + rest * ds * dv),
            sa + share * (other_sa - sa + rest * ds * da),
            vv + share * (other_vv - vv + rest * dv * dv),
            va + share * (other_va - va + rest * dv * da),
            aa + share * (other_aa - aa + rest * da * da),
        ),
        stays + comes,
    )


def _move(mode: Mode, motion: Motion) -> Mode:
    """Returns the mode after a motion: T mean, T covariance T' + noise, written out."""
    (s, v, a), (ss, sv, sa, vv, va, aa), probability = mode
    v_to_s, a_to_s, a_to_v, a_to_a, (q_ss, q_sv, q_sa, q_vv, q_va, q_aa) = motion
    # T covariance first, rows s and v.
    ss, sv, sa = ss + v_to_s * sv + a_to_s * sa, sv + v_to_s * vv + a_to_s * va, sa + v_to_s * va + a_to_s * aa
    vv, va_after = vv + a_to_v * va, va + a_to_v * aa
    return Mode(
        (s + v_to_s * v + a_to_s * a, v + a_to_v * a, a_to_a * a),
        (
            ss + v_to_s * sv + a_to_s * sa + q_ss,
            sv + a_to_v * sa + q_sv,
            a_to_a * sa + q_sa,
            vv + a_to_v * va_after + q_vv,
            a_to_a * va_after + q_va,
            a_to_a * a_to_a * aa + q_aa,
        ),
        probability,
    )
