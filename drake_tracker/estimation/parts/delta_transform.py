"""The transform T_delta from one sampling instant to the next (Allen et al. 1991, equation 6), and its powers.

T_delta acts in the chord frame of a point: the origin is the point, the x axis lies along the chord from the previous
point. T_delta turns by the bending phi and then advances by the arc length s. On a circle this gives exactly the next
point, in that point's own chord frame.
"""

import numpy as np
from numpy.typing import ArrayLike


def delta_transform(s: float, phi: float, dz: float) -> np.ndarray:
    """Returns T_delta = Rot(z, phi) Trans(x, s) Trans(z, dz), shape (4, 4).

    Args:
        s: arc length [m].
        phi: bending [rad].
        dz: climb [m].
    """
    c, sn = np.cos(phi), np.sin(phi)
    return np.array([[c, -sn, 0.0, s * c], [sn, c, 0.0, s * sn], [0.0, 0.0, 1.0, dz], [0.0, 0.0, 0.0, 1.0]])


def delta_power(s: float, phi: float, n: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Returns the n-th power of T_delta in the plane, as (position, turn).

    The position is complex, x + iy [m] in the chord frame; the turn is n phi [rad]; both have the shape of ``n``. All
    powers of T_delta rotate about the centre of the circle, also fractional and negative ones. For an integer n the sum
    of s e^(i j phi) over j = 1..n is s e^(i (n + 1) phi / 2) sin(n phi / 2) / sin(phi / 2).

    Args:
        s: arc length [m].
        phi: bending [rad].
        n: the exponents, any real numbers; negative ones lead into the past.
    """
    n = np.asarray(n, dtype=float)
    half = 0.5 * phi
    distance = n * s if abs(half) < 1e-9 else s * np.sin(n * half) / np.sin(half)
    return distance * np.exp(1j * (n + 1.0) * half), n * phi
