"""The effect of noise on a measured arc length and bending (Allen et al. 1991, section 4.2 and appendix B).

The distance s between an object and a point measured with isotropic Gaussian noise has a Rice distribution; its mean is
longer than the true s_0. From the mean s_1 and the root mean square s_2 one recovers s_0 and sigma. With *two* noisy
end points the same holds for the noise of their difference, so that the sigma returned is sqrt(2) times the noise of
one point.

The paper measures in a plane. In space the distance has a noncentral chi distribution with three degrees of freedom,
whose density and mean need no Bessel functions (docs/explanation/frenet.md). Functions with an argument ``dimensions``
know both: 2 is the paper's plane, 3 is space.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf, i0e, i1e, ndtr

from drake_tracker.core.frozen_state import read_only

RATIO_LIMIT = 2.0 / np.sqrt(np.pi)
"""Largest ratio p = s_2 / s_1 of a Rice distribution (at s_0 = 0); above it equation (16) has no root."""
RATIO_LIMITS = {2: RATIO_LIMIT, 3: np.sqrt(3.0 * np.pi / 8.0)}
"""{dimensions: the same limit}."""


def arc_length_density(s: ArrayLike, s_0: float, sigma: float, dimensions: int = 2) -> np.ndarray:
    """Returns the density f(s), of the shape of ``s`` [1/m]: in a plane the Rice density of equation (11).

    Args:
        s: measured arc lengths, zero or more [m].
        s_0: true arc length, zero or more [m].
        sigma: noise, positive [m].
        dimensions: 2 or 3; in space s_0 must be positive.
    """
    s = np.asarray(s, dtype=float)
    if dimensions == 3:
        near, far = (np.exp(-0.5 * ((s - end) / sigma) ** 2) for end in (s_0, -s_0))
        return s / (np.sqrt(2.0 * np.pi) * sigma * s_0) * (near - far)
    # exp(-(s^2 + s_0^2) / 2 sigma^2) I_0(s s_0 / sigma^2) without the overflow of I_0.
    return s / sigma**2 * np.exp(-0.5 * ((s - s_0) / sigma) ** 2) * i0e(s * s_0 / sigma**2)


def mean_factor(x: Any, dimensions: int = 2) -> Any:
    """Returns u(x) = s_1 / sigma, in a plane that of equation (13).

    It uses exponentially scaled Bessel functions, because the plain ones overflow from x = 53.

    Args:
        x: s_0 / sigma, a number or an array; positive in space.
        dimensions: 2 or 3.
    """
    if dimensions == 3:
        return np.sqrt(2.0 / np.pi) * np.exp(-0.5 * np.square(x)) + (x + 1.0 / x) * erf(x / np.sqrt(2.0))
    y = 0.25 * np.square(x)
    return np.sqrt(np.pi / 2.0) * (i0e(y) + 2.0 * y * (i0e(y) + i1e(y)))


def moment_ratio(x: Any, dimensions: int = 2) -> Any:
    """Returns u_1(x) = sqrt(x^2 + dimensions) / u(x), in a plane that of equation (16).

    It falls from the `RATIO_LIMITS` at x = 0 to 1.

    Args:
        x: s_0 / sigma, a number or an array; positive in space.
        dimensions: 2 or 3.
    """
    return np.sqrt(np.square(x) + float(dimensions)) / mean_factor(x, dimensions)


_NODES = read_only(np.geomspace(0.05, 200.0, 512)[::-1])
_NODE_LOG_EXCESS = {n: read_only(np.log(moment_ratio(_NODES, n) - 1.0)) for n in RATIO_LIMITS}
_NODE_LOG = read_only(np.log(_NODES))


def noise_ratio(p: float, dimensions: int = 2) -> float:
    """Returns x_0(p) = s_0 / sigma, the root of equation (16), from a table of u_1.

    The table is interpolated in log(p - 1) and log(x), where it is straight at large x (p - 1 ~ 1 / 2x^2, in a plane
    and in space). p <= 1 (no noise) gives infinity; p at or above the `RATIO_LIMITS`, where there is no root, and the
    last 1e-7 below them give 0.

    Args:
        p: the ratio s_2 / s_1.
        dimensions: 2 or 3.
    """
    excess = p - 1.0
    if excess <= 0.0:
        return np.inf
    log_excess, nodes = np.log(excess), _NODE_LOG_EXCESS[dimensions]
    if log_excess > nodes[-1]:
        return 0.0
    if log_excess < nodes[0]:
        return np.sqrt(0.5 / excess)
    return np.exp(np.interp(log_excess, nodes, _NODE_LOG))


class ArcLengthEstimate(NamedTuple):
    """The estimates that follow from the moments of measured arc lengths.

    Attributes:
        s_0: true arc length [m].
        sigma: noise [m].
        has_root: whether the ratio p has a root.
    """

    s_0: float
    sigma: float
    has_root: bool


def recover_arc_length(s_1: float, s_2_squared: float, dimensions: int = 2) -> ArcLengthEstimate:
    """Returns the true arc length and the noise by equations (16)-(18).

    Where p = s_2 / s_1 exceeds the `RATIO_LIMITS` the moments fit no distribution (too few samples, or an object at
    rest). Then ``has_root`` is False and s_0 is 0, and the caller should keep its last estimate.

    Args:
        s_1: mean of the measured arc lengths, E(s) [m].
        s_2_squared: their mean square, E(s^2) [m^2].
        dimensions: 2 or 3.
    """
    s_2 = np.sqrt(max(s_2_squared, 0.0))
    if not s_1 > 0.0:
        return ArcLengthEstimate(0.0, 0.0, False)
    p = s_2 / s_1
    x = noise_ratio(p, dimensions)
    if np.isinf(x):
        return ArcLengthEstimate(float(s_2), 0.0, True)
    scale = s_2 / np.sqrt(dimensions + x * x)
    return ArcLengthEstimate(float(x * scale), float(scale), bool(p <= RATIO_LIMITS[dimensions]))


def bending_density(phi: ArrayLike, phi_0: float, k: float) -> np.ndarray:
    """Returns the density f(phi) of the bending, section 4.2, for |phi - phi_0| < pi / 2; zero elsewhere [1/rad].

    The normalizing factor is sqrt(2 pi) k (the paper prints the root over k as well). The density leaves out points
    measured behind the object: it integrates to erf(1 / (sqrt(2) k)), and its mean is phi_0.

    Args:
        phi: measured bending, a number or an array [rad].
        phi_0: true bending [rad].
        k: sigma / s_0.
    """
    angle = np.asarray(phi, dtype=float) - phi_0
    density = np.cos(angle) / (np.sqrt(2.0 * np.pi) * k) * np.exp(-0.5 * (np.sin(angle) / k) ** 2)
    return np.where(np.abs(angle) < 0.5 * np.pi, density, 0.0)


def exact_bending_density(phi: ArrayLike, phi_0: float, k: float) -> np.ndarray:
    """Returns the density of the direction of a noisy point over the whole circle [1/rad].

    The density includes points behind the object, which `bending_density` omits, and integrates to one over any full
    turn.

    Args:
        phi: measured direction, a number or an array [rad].
        phi_0: true direction [rad].
        k: sigma / s_0.
    """
    angle = np.asarray(phi, dtype=float) - phi_0
    ahead = np.cos(angle) / k
    behind = np.exp(-0.5 / k**2) / (2.0 * np.pi)
    return behind + ahead * ndtr(ahead) / np.sqrt(2.0 * np.pi) * np.exp(-0.5 * (np.sin(angle) / k) ** 2)


def direction_density(angle: ArrayLike, k: float) -> np.ndarray:
    """Returns the density of the angle between a noisy direction in space and the true one, from 0 to pi [1/rad].

    It is the counterpart in space of `exact_bending_density`. An angle in space has no sign, so that its mean is not
    zero; filters therefore average the vector of the bending.

    Args:
        angle: a number or an array, from 0 to pi [rad].
        k: sigma / s_0.
    """
    ahead, across = np.cos(angle) / k, np.sin(angle)
    within = (1.0 + ahead**2) * ndtr(ahead) * np.exp(-0.5 * (across / k) ** 2)
    return across * (within + ahead / np.sqrt(2.0 * np.pi) * np.exp(-0.5 / k**2))


def torsion_density(psi: ArrayLike, psi_0: float, k: float, phi_0: float) -> np.ndarray:
    """Returns the density of the torsion between two chord frames, over the whole circle [1/rad].

    Torsion is the direction of the next chord around this one. The next chord is only s_0 sin(phi_0) away from the axis
    of this one, so that the density is that of a bending with 1 / sin(phi_0) times the noise.

    Args:
        psi: measured torsion, a number or an array [rad].
        psi_0: true torsion [rad].
        k: sigma / s_0.
        phi_0: true bending, not zero [rad].
    """
    return exact_bending_density(psi, psi_0, k / np.sin(phi_0))
