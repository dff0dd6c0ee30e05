"""What noise does to a measured arc length and bending (Allen et al. 1991, section 4.2 and appendix B).

The distance s between an object and a point measured with isotropic Gaussian noise has a Rice distribution: its mean is
longer than the true s_0.  Mean s_1 and root mean square s_2 give back s_0 and sigma.  With *two* noisy end points the
same holds for the noise of their difference, so that the sigma returned is sqrt(2) times that of one point.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import i0e, i1e, ndtr

RATIO_LIMIT = 2.0 / np.sqrt(np.pi)
"""Largest ratio p = s_2 / s_1 a Rice distribution can have (at s_0 = 0); equation (16) has no root above it."""


def arc_length_density(s, s_0, sigma):
    """Returns f(s), the Rice density of equation (11) [1/m], for s >= 0, s_0 >= 0 and sigma > 0 [m]."""
    s = np.asarray(s, dtype=float)
    # exp(-(s^2 + s_0^2) / 2 sigma^2) I_0(s s_0 / sigma^2) without the overflow of I_0.
    return s / sigma**2 * np.exp(-0.5 * ((s - s_0) / sigma) ** 2) * i0e(s * s_0 / sigma**2)


def mean_factor(x):
    """Returns u(x) = s_1 / sigma of equation (13), x = s_0 / sigma.

    Exponentially scaled Bessel functions: the plain ones overflow from x = 53.
    """
    y = 0.25 * np.square(x)
    return np.sqrt(np.pi / 2.0) * (i0e(y) + 2.0 * y * (i0e(y) + i1e(y)))


def moment_ratio(x):
    """Returns u_1(x) = sqrt(x^2 + 2) / u(x) of equation (16), falling from `RATIO_LIMIT` at x = 0 to 1."""
    return np.sqrt(np.square(x) + 2.0) / mean_factor(x)


_NODES = np.geomspace(0.05, 200.0, 512)[::-1]
_NODE_LOG_EXCESS = np.log(moment_ratio(_NODES) - 1.0)
_NODE_LOG = np.log(_NODES)
for _table in (_NODES, _NODE_LOG_EXCESS, _NODE_LOG):
    _table.setflags(write=False)


def noise_ratio(p):
    """Returns x_0(p) = s_0 / sigma, the root of equation (16), from the table of u_1.

    The table is read in log(p - 1) and log(x), where it is straight at large x (p - 1 ~ 1 / 2x^2).  p <= 1 (no noise)
    gives infinity; p at or above `RATIO_LIMIT`, where there is no root, and the last 1e-7 below it give 0.
    """
    excess = p - 1.0
    if excess <= 0.0:
        return np.inf
    log_excess = np.log(excess)
    if log_excess > _NODE_LOG_EXCESS[-1]:
        return 0.0
    if log_excess < _NODE_LOG_EXCESS[0]:
        return np.sqrt(0.5 / excess)
    return np.exp(np.interp(log_excess, _NODE_LOG_EXCESS, _NODE_LOG))


class ArcLengthEstimate(NamedTuple):
    """True arc length s_0 [m], noise sigma [m], and whether the ratio p had a root."""

    s_0: float
    sigma: float
    has_root: bool


def recover_arc_length(s_1, s_2_squared):
    """Returns the `ArcLengthEstimate` of the moments E(s) [m] and E(s^2) [m^2] by equations (16)-(18).

    Where p = s_2 / s_1 exceeds `RATIO_LIMIT` the moments fit no Rice distribution (too few samples, or an object at
    rest): ``has_root`` is False, s_0 is 0, and the caller should keep what it knew before.
    """
    s_2 = np.sqrt(max(s_2_squared, 0.0))
    if not s_1 > 0.0:
        return ArcLengthEstimate(0.0, 0.0, False)
    p = s_2 / s_1
    x = noise_ratio(p)
    if np.isinf(x):
        return ArcLengthEstimate(float(s_2), 0.0, True)
    scale = s_2 / np.sqrt(2.0 + x * x)
    return ArcLengthEstimate(float(x * scale), float(scale), bool(p <= RATIO_LIMIT))


def bending_density(phi, phi_0, k):
    """Returns f(phi) of the bending, section 4.2, for |phi - phi_0| < pi / 2 and k = sigma / s_0; zero elsewhere.

    The normalising factor is sqrt(2 pi) k (the paper prints the root over k as well).  The density leaves out points
    measured behind the object: it integrates to erf(1 / (sqrt(2) k)), and its mean is phi_0.
    """
    angle = np.asarray(phi, dtype=float) - phi_0
    density = np.cos(angle) / (np.sqrt(2.0 * np.pi) * k) * np.exp(-0.5 * (np.sin(angle) / k) ** 2)
    return np.where(np.abs(angle) < 0.5 * np.pi, density, 0.0)


def exact_bending_density(phi, phi_0, k):
    """Returns the density of the direction of a point with noise k = sigma / s_0 over the whole circle.

    It includes what `bending_density` leaves out, and integrates to one over any turn.
    """
    angle = np.asarray(phi, dtype=float) - phi_0
    ahead = np.cos(angle) / k
    behind = np.exp(-0.5 / k**2) / (2.0 * np.pi)
    return behind + ahead * ndtr(ahead) / np.sqrt(2.0 * np.pi) * np.exp(-0.5 * (np.sin(angle) / k) ** 2)
