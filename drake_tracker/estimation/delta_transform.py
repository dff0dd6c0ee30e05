"""The transform T_delta from one sampling instant to the next (Allen et al. 1991, equation 6), and its powers.

T_delta acts in the chord frame of a point: origin at the point, x along the chord from the point before it.  It turns
by the bending phi and then goes the arc length s ahead, which lands on the next point of a circle exactly, in that
point's own chord frame.
"""

import numpy as np


def delta_transform(s, phi, dz):
    """Returns T_delta = Rot(z, phi) Trans(x, s) Trans(z, dz), shape (4, 4); s and dz in [m], phi in [rad]."""
    c, sn = np.cos(phi), np.sin(phi)
    return np.array([[c, -sn, 0.0, s * c], [sn, c, 0.0, s * sn], [0.0, 0.0, 1.0, dz], [0.0, 0.0, 0.0, 1.0]])


def delta_power(s, phi, n):
    """Returns (position, turn) of T_delta^n: complex x + iy [m] in the chord frame, shape of n, and n phi [rad].

    n is any array of real numbers, negative ones for the past: T_delta turns about the centre of the circle, and so
    does each of its powers.  The sum of a whole number of steps, s e^(i j phi) for j = 1..n, is
    s e^(i (n + 1) phi / 2) sin(n phi / 2) / sin(phi / 2).
    """
    n = np.asarray(n, dtype=float)
    half = 0.5 * phi
    if abs(half) < 1e-9:
        distance = n * s
    else:
        distance = s * np.sin(n * half) / np.sin(half)
    return distance * np.exp(1j * (n + 1.0) * half), n * phi
