"""Where on a known path an object is, and how fast: Kalman filters of arc length, speed and acceleration, mixed.

One assumes that the speed hardly changes and becomes sharp; one follows a speed that rises and falls gently, and so
foresees how it goes on; one follows an object that brakes, stops or backs up, of which a moment later nothing can be
foreseen. Which is believed follows from how well each foresaw the measurements: an interacting multiple model (Blom
and Bar-Shalom 1988).
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from drake_tracker.estimation.parameters import positive

CRUISE, MANOEUVRE, STOP = range(3)
SOJOURN = (1000.0, 6.0, 1.0)
"""Mean time [s] that an object stays in a mode; it leaves it for each of the others alike."""
LEAST_PROBABILITY = 1e-9
LONGEST_STEP = 10.0
"""Over more than so many times the time in which an acceleration fades, the matrix exponential loses its digits."""


class Mode(NamedTuple):
    """One filter, in plain numbers, which for so few are faster than arrays.

    mean: arc length s [m], speed v [m/s], acceleration a [m/s^2]. covariance: of ss, sv, sa, vv, va, aa.
    probability: of the mode.
    """

    mean: tuple
    covariance: tuple
    probability: float


class Motion(NamedTuple):
    """From one instant to another: s gains ``v_to_s`` v + ``a_to_s`` a, v gains ``a_to_v`` a, and a shrinks to
    ``a_to_a`` a; ``noise`` is what the covariance gains, in its order."""

    v_to_s: float
    a_to_s: float
    a_to_v: float
    a_to_a: float
    noise: tuple


class PhaseFilter:
    """The mixed filter; functional, its state is a tuple of `Mode`: `CRUISE`, `MANOEUVRE`, `STOP`.

    Args:
        cruise_noise: how the speed wanders while cruising, standard deviation of its change in a second [m/s/sqrt(s)].
        manoeuvre_noise: how the acceleration wanders in a gentle manoeuvre, likewise [m/s^2/sqrt(s)].
        fading: time [s] in which its acceleration dies away.
        stop_noise, stop_fading: the same of an object that stops or starts within half a second.
    """

    def __init__(self, cruise_noise=5e-5, manoeuvre_noise=0.04, fading=1.0, stop_noise=1.0, stop_fading=0.15):
        positive("phase filter", cruise_noise=cruise_noise, manoeuvre_noise=manoeuvre_noise, stop_noise=stop_noise)
        positive("phase filter", fading=fading, stop_fading=stop_fading)
        motions = (
            _white_acceleration(cruise_noise**2),
            _fading_acceleration(manoeuvre_noise**2, fading),
            _fading_acceleration(stop_noise**2, stop_fading),
        )
        # Keyed by rounded times: sums of periods differ in their last digits.
        self._motions = tuple(lru_cache(maxsize=1024)(motion) for motion in motions)
        self._arc_lengths = lru_cache(maxsize=64)(self._arc_lengths)

    def start(self, s, v, s_variance, v_variance):
        """Returns the state of an object at ``s`` [m] with speed ``v`` [m/s]."""
        mode = Mode((float(s), float(v), 0.0), (float(s_variance), 0.0, 0.0, float(v_variance), 0.0, 0.01), 1.0 / 3.0)
        return mode, mode, mode

    def propagate(self, modes, dt):
        """Returns the modes ``dt`` [s] later, mixed by how likely a change between them was."""
        dt = round(dt, 9)
        return tuple(_drive(mode, motion(dt)) for mode, motion in zip(_mix(modes, dt), self._motions, strict=True))

    def correct(self, modes, s, variance):
        """Returns the modes after a measurement of arc length ``s`` [m] with ``variance`` [m^2]."""
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
            Mode(mean, covariance, min(max(weight / total, LEAST_PROBABILITY), 1.0))
            for (mean, covariance), weight in zip(corrected, weights, strict=True)
        )

    @staticmethod
    def shift(modes, way):
        """Returns the modes with all arc lengths ``way`` [m] greater."""
        return tuple(mode._replace(mean=(mode.mean[0] + way, *mode.mean[1:])) for mode in modes)

    def ahead(self, modes, taus):
        """Returns (arc lengths [m], their standard deviations [m]) expected after ``taus`` (n,) [s], all modes as one.

        The deviations are averaged, not the variances: a mode that is next to impossible does not widen what 68 of 100
        errors stay within.
        """
        taus = tuple([round(tau, 9) for tau in np.asarray(taus).tolist()])
        ways, deviations = [], []
        for mode, (v_to_s, a_to_s, noise) in zip(modes, self._arc_lengths(taus), strict=True):
            (s, v, a), (ss, sv, sa, vv, va, aa), _ = mode
            ways.append(s + v_to_s * v + a_to_s * a)
            # As `_drive`, of which only the arc length is needed, to all instants at once.
            ss, sv, sa = ss + v_to_s * sv + a_to_s * sa, sv + v_to_s * vv + a_to_s * va, sa + v_to_s * va + a_to_s * aa
            deviations.append(np.sqrt(np.maximum(ss + v_to_s * sv + a_to_s * sa + noise, 0.0)))
        shares = [mode.probability for mode in modes]
        s = sum(share * way for share, way in zip(shares, ways, strict=True))
        spreads = [share * np.hypot(d, way - s) for share, d, way in zip(shares, deviations, ways, strict=True)]
        return s, sum(spreads)

    def _arc_lengths(self, taus):
        """Returns, for each mode, (3, n): ``v_to_s``, ``a_to_s`` and the noise of s of its motions over ``taus``."""
        rows = [[(step.v_to_s, step.a_to_s, step.noise[0]) for step in map(motion, taus)] for motion in self._motions]
        return [np.array(columns).reshape(-1, 3).T.copy() for columns in rows]


def centre(modes):
    """Returns the arc length [m] that the modes expect together."""
    return sum([mode.probability * mode.mean[0] for mode in modes])


def spread(modes):
    """Returns the arc length [m] that the modes expect together, and its variance [m^2]."""
    s = centre(modes)
    return s, sum([mode.probability * (mode.covariance[0] + (mode.mean[0] - s) ** 2) for mode in modes])


def deviations(modes, s, variance):
    """Returns by how many deviations a measurement of arc length ``s`` [m] with ``variance`` [m^2] is off, of the mode
    that expected it most."""
    return math.sqrt(min([(s - mode.mean[0]) ** 2 / (mode.covariance[0] + variance) for mode in modes]))


def _mix(modes, dt):
    """Returns the modes, each with what came to it from the others in ``dt`` [s]."""
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


def _blend(mode, other, stays, comes):
    """Returns the mode of probability ``stays`` with what ``comes`` from the other: the mean and spread of both."""
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


def _drive(mode, motion):
    """Returns the mode after a `Motion`: T mean, T covariance T' + noise, written out."""
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


def _white_acceleration(q):
    """Returns a function of dt: the `Motion` of a speed that wanders by variance ``q`` in a second; an acceleration
    left over from another mode is dropped."""

    def motion(dt):
        return Motion(dt, 0.0, 0.0, 0.0, (q * dt**3 / 3.0, q * dt**2 / 2.0, 0.0, q * dt, 0.0, 0.0))

    return motion


def _fading_acceleration(q, fading):
    """Returns a function of dt: the `Motion` of an acceleration that fades in ``fading`` [s] and wanders by variance
    ``q`` in a second (Singer 1970)."""
    generator = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / fading]])

    def both(dt):
        """Returns transition and noise, each (3, 3)."""
        if dt > LONGEST_STEP * fading:  # the exponential holds exp(dt / fading): of a long time, twice the half
            transition, noise = both(0.5 * dt)
            return transition @ transition, noise + transition @ noise @ transition.T
        # Van Loan 1978: one matrix exponential holds both.
        block = np.zeros((6, 6))
        block[:3, :3], block[3:, 3:] = -generator, generator.T
        block[2, 5] = q
        exponential = expm(block * dt)
        transition = exponential[3:, 3:].T
        return transition, transition @ exponential[:3, 3:]

    def motion(dt):
        if dt < 0.0:  # back in time an acceleration that fades would have been without limit
            return Motion(dt, 0.0, 0.0, 0.0, (0.0,) * 6)
        transition, noise = both(dt)
        (_, v_to_s, a_to_s), (_, _, a_to_v), (_, _, a_to_a) = transition.tolist()
        return Motion(v_to_s, a_to_s, a_to_v, a_to_a, tuple(noise[np.triu_indices(3)].tolist()))

    return motion
