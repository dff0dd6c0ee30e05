"""The motions of the phase filter: how arc length, speed and acceleration develop over a time."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

CHANGE_TIME = 0.02
"""How well the time of a sudden change of speed is known, which also takes a while [s]."""
MAX_STEP = 10.0
"""Over more than this many time constants of the acceleration the matrix exponential loses its digits."""


class Motion(NamedTuple):
    """The linear map of (s, v, a) over a time.

    s gains ``v_to_s`` v + ``a_to_s`` a, v gains ``a_to_v`` a, and a becomes ``a_to_a`` a.

    Attributes:
        v_to_s: change of s per speed [s].
        a_to_s: change of s per acceleration [s^2].
        a_to_v: change of v per acceleration [s].
        a_to_a: fraction of the acceleration that remains.
        noise: what the covariance gains, in the order ss, sv, sa, vv, va, aa.
    """

    v_to_s: float
    a_to_s: float
    a_to_v: float
    a_to_a: float
    noise: tuple[float, float, float, float, float, float]


def white_acceleration(q: float) -> Callable[[float], Motion]:
    """Returns a function of the time [s]: the `Motion` of a speed that is a random walk.

    An acceleration left over from another mode is dropped.

    Args:
        q: growth of the variance of the speed per second [m^2/s^3].
    """

    def motion(dt: float) -> Motion:
        return Motion(dt, 0.0, 0.0, 0.0, (q * dt**3 / 3.0, q * dt**2 / 2.0, 0.0, q * dt, 0.0, 0.0))

    return motion


def fading_acceleration(q: float, fading: float) -> Callable[[float], Motion]:
    """Returns a function of the time [s]: the `Motion` of an acceleration that decays and is disturbed (Singer 1970).

    Args:
        q: growth of the variance of the acceleration per second [m^2/s^5].
        fading: time constant of the decay [s].
    """
    from scipy.linalg import expm  # slow to load, and not needed by most estimators

    generator = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / fading]])

    def both(dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns transition and noise, each (3, 3)."""
        if dt > MAX_STEP * fading:  # the exponential contains exp(dt / fading), so a long time is two halves
            transition, noise = both(0.5 * dt)
            return transition @ transition, noise + transition @ noise @ transition.T
        # Van Loan 1978: one matrix exponential contains both.
        block = np.zeros((6, 6))
        block[:3, :3], block[3:, 3:] = -generator, generator.T
        block[2, 5] = q
        exponential = expm(block * dt)
        transition = exponential[3:, 3:].T
        return transition, transition @ exponential[:3, 3:]

    def motion(dt: float) -> Motion:
        if dt < 0.0:  # backwards in time a decaying acceleration would grow without limit
            return Motion(dt, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        transition, noise = both(dt)
        (_, v_to_s, a_to_s), (_, _, a_to_v), (_, _, a_to_a) = transition.tolist()
        return Motion(v_to_s, a_to_s, a_to_v, a_to_a, tuple(noise[np.triu_indices(3)].tolist()))

    return motion
