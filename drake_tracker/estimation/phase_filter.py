"""Where on a known path an object is, and how fast: two Kalman filters of arc length, speed and acceleration, mixed.

One assumes that the speed hardly changes and becomes sharp; the other follows an object that brakes, stops or backs up.
Which is believed follows from how well each foresaw the measurements: an interacting multiple model (Blom and
Bar-Shalom 1988).
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from drake_tracker.errors import DrakeTrackerError
from drake_tracker.estimation.alpha_beta_gamma import read_only

CRUISE, MANOEUVRE = range(2)
SOJOURN = (300.0, 3.0)
"""Mean time [s] that an object stays in a mode."""
LEAST_PROBABILITY = 1e-9


class Mode(NamedTuple):
    """One filter (arrays are read-only): mean (3,) of arc length [m], speed [m/s], acceleration [m/s^2]; covariance
    (3, 3); probability of the mode."""

    mean: np.ndarray
    covariance: np.ndarray
    probability: float


class PhaseFilter:
    """The mixed filter; functional, its state is a pair of `Mode`.

    Args:
        cruise_noise: how the speed wanders while cruising, standard deviation of its change in a second [m/s/sqrt(s)].
        manoeuvre_noise: how the acceleration wanders in a manoeuvre, likewise [m/s^2/sqrt(s)].
        fading: time [s] in which an acceleration dies away.
    """

    def __init__(self, cruise_noise=5e-5, manoeuvre_noise=0.1, fading=0.5):
        for name, value in (("cruise_noise", cruise_noise), ("manoeuvre_noise", manoeuvre_noise), ("fading", fading)):
            if not 0.0 < value < math.inf:
                raise DrakeTrackerError(f"phase filter: {name} is {value}; it must be positive and finite")
        cruise = _white_acceleration(cruise_noise**2)
        manoeuvre = _fading_acceleration(manoeuvre_noise**2, fading)
        # Keyed by rounded times: sums of periods differ in their last digits.
        self._motions = tuple(lru_cache(maxsize=1024)(motion) for motion in (cruise, manoeuvre))

    def start(self, s, v, s_variance, v_variance):
        """Returns the state of an object at ``s`` [m] with speed ``v`` [m/s]."""
        mean = read_only(np.array([s, v, 0.0]))
        covariance = read_only(np.diag([s_variance, v_variance, 0.01]))
        return Mode(mean, covariance, 0.5), Mode(mean, covariance, 0.5)

    def propagate(self, modes, dt):
        """Returns the modes ``dt`` [s] later, mixed by how likely a change between them was."""
        dt = round(dt, 9)
        return tuple(_drive(mode, motion(dt)) for mode, motion in zip(_mix(modes, dt), self._motions, strict=True))

    def correct(self, modes, s, variance):
        """Returns the modes after a measurement of arc length ``s`` [m] with ``variance`` [m^2]."""
        corrected, weights = [], []
        for mean, covariance, probability in modes:
            total = covariance[0, 0] + variance
            gain = covariance[:, 0] / total
            residual = s - mean[0]
            likelihood = math.exp(-0.5 * min(residual * residual / total, 200.0)) / math.sqrt(total)
            weights.append(probability * likelihood)
            corrected.append((mean + gain * residual, covariance - np.multiply.outer(gain, covariance[0])))
        total = sum(weights)
        return tuple(
            Mode(read_only(mean), read_only(covariance), min(max(weight / total, LEAST_PROBABILITY), 1.0))
            for (mean, covariance), weight in zip(corrected, weights, strict=True)
        )

    @staticmethod
    def shift(modes, way):
        """Returns the modes with all arc lengths ``way`` [m] greater."""
        return tuple(mode._replace(mean=read_only(mode.mean + [way, 0.0, 0.0])) for mode in modes)

    def ahead(self, modes, taus):
        """Returns (arc lengths [m], their standard deviations [m]) expected after ``taus`` (n,) [s], both modes as one.

        The deviations are averaged, not the variances: a mode that is next to impossible does not widen what 68 of 100
        errors stay within.
        """
        ways, deviations = [], []
        for mode, motion in zip(modes, self._motions, strict=True):
            motions = [motion(round(tau, 9)) for tau in np.asarray(taus).tolist()]
            rows = np.array([transition[0] for transition, _ in motions])
            noise = np.array([covariance[0, 0] for _, covariance in motions])
            ways.append(rows @ mode.mean)
            deviations.append(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, mode.covariance, rows) + noise, 0.0)))
        shares = [mode.probability for mode in modes]
        s = sum(share * way for share, way in zip(shares, ways, strict=True))
        spreads = [share * np.hypot(d, way - s) for share, d, way in zip(shares, deviations, ways, strict=True)]
        return s, sum(spreads)


def spread(modes):
    """Returns the arc length [m] that the modes expect together, and its variance [m^2]."""
    s = sum(mode.probability * mode.mean[0] for mode in modes)
    return s, sum(mode.probability * (mode.covariance[0, 0] + (mode.mean[0] - s) ** 2) for mode in modes)


def _mix(modes, dt):
    leave = [1.0 - math.exp(-dt / sojourn) for sojourn in SOJOURN]
    mixed = []
    for index, (mean, covariance, probability) in enumerate(modes):
        other = modes[1 - index]
        stays, comes = probability * (1.0 - leave[index]), other.probability * leave[1 - index]
        share = comes / (stays + comes)
        difference = other.mean - mean
        mixed.append(
            Mode(
                mean + share * difference,
                covariance
                + share * (other.covariance - covariance)
                + share * (1.0 - share) * np.multiply.outer(difference, difference),
                stays + comes,
            )
        )
    return mixed


def _drive(mode, motion):
    transition, noise = motion
    mean, covariance = transition @ mode.mean, transition @ mode.covariance @ transition.T + noise
    return Mode(read_only(mean), read_only(covariance), mode.probability)


def _white_acceleration(q):
    """Returns a function of dt: (transition, noise covariance) of a speed that wanders by variance ``q`` in a second;
    an acceleration left over from another mode is dropped."""

    def motion(dt):
        transition = np.array([[1.0, dt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
        noise = q * np.array([[dt**3 / 3.0, dt**2 / 2.0, 0.0], [dt**2 / 2.0, dt, 0.0], [0.0, 0.0, 0.0]])
        return transition, noise

    return motion


def _fading_acceleration(q, fading):
    """Returns a function of dt: (transition, noise covariance) of an acceleration that fades in ``fading`` [s] and
    wanders by variance ``q`` in a second (Singer 1970)."""
    generator = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / fading]])

    def motion(dt):
        # Van Loan 1978: one matrix exponential holds both.
        block = np.zeros((6, 6))
        block[:3, :3], block[3:, 3:] = -generator, generator.T
        block[2, 5] = q
        exponential = expm(block * dt)
        transition = exponential[3:, 3:].T
        return transition, transition @ exponential[:3, 3:]

    return motion
