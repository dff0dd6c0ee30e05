"""The circular arc that the arc-length filter fits to the newest points, and its extrapolation."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Arc(NamedTuple):
    """A chord frame, and the T_delta that advances it by one baseline.

    Attributes:
        anchor: origin of the chord frame, (x, y, z) in W [m].
        time: time at the anchor [s].
        chord_heading: direction of the chord [rad].
        s_0: arc length of one baseline [m].
        phi_0: bending over one baseline [rad].
        dz: climb over one baseline [m].
        baseline: number of frames in a baseline.
        heading: direction of travel at the newest point, held while the object is at rest [rad].
    """

    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time: float = 0.0
    chord_heading: float = 0.0
    s_0: float = 0.0
    phi_0: float = 0.0
    dz: float = 0.0
    baseline: int = 1
    heading: float = 0.0

    def at(self, times: np.ndarray, period: float) -> np.ndarray:
        """Returns an object's path along the arc, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        Args:
            times: absolute times, shape (n,) [s], before or after the anchor's.
            period: time of one frame [s].
        """
        n = (times - self.time) / (self.baseline * period)
        position, turn = delta_power(self.s_0, self.phi_0, n)
        position = position * complex(math.cos(self.chord_heading), math.sin(self.chord_heading))
        x, y, z = self.anchor
        rows = np.empty((len(times), 4))
        rows[:, 0] = x + position.real
        rows[:, 1] = y + position.imag
        rows[:, 2] = z + n * self.dz
        rows[:, 3] = self.chord_heading + 0.5 * self.phi_0 + turn
        return rows


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
    powers of T_delta, also fractional and negative powers, rotate about the centre of the circle. For an integer n the
    sum of s e^(i j phi) over j = 1..n is s e^(i (n + 1) phi / 2) sin(n phi / 2) / sin(phi / 2).

    Args:
        s: arc length [m].
        phi: bending [rad].
        n: the exponents, any real numbers; negative ones lead into the past.
    """
    n = np.asarray(n, dtype=float)
    half = 0.5 * phi
    distance = n * s if abs(half) < 1e-9 else s * np.sin(n * half) / np.sin(half)
    return distance * np.exp(1j * (n + 1.0) * half), n * phi
