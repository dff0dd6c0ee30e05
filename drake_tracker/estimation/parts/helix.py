"""The helix that the arc-length filter in space fits to the newest points: the full Frenet frame of section 4.1.

Allen et al. 1991 describe a path in a plane by arc length and bending, and say that the method "can be extended to
include another parameter which will create a full Frenet frame at each instant". The parameter is the torsion between
chord frames. T_delta then rotates by both angles, and its powers lead along a helix (docs/explanation/frenet.md).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from drake_tracker.core.frozen_state import read_only


class Helix(NamedTuple):
    """A chord, and the rotation that turns each chord into the next one.

    Attributes:
        anchor: end of the chord, shape (3,), in W [m].
        time: time at the anchor [s].
        chord: the chord of one baseline that ends at the anchor, shape (3,), in W [m].
        turn: rotation vector from a chord to the next one, shape (3,), in W [rad]. It has the direction of the axis of
            the helix and is the same for all chords. Its part along the chord is torsion, the rest is bending.
        s_0: length of the chord [m].
        baseline: number of frames in a baseline.
        heading: horizontal direction of travel at the newest point, held while the object is at rest [rad].
    """

    anchor: np.ndarray
    time: float
    chord: np.ndarray
    turn: np.ndarray
    s_0: float = 0.0
    baseline: int = 1
    heading: float = 0.0

    def at(self, times: np.ndarray, period: float) -> np.ndarray:
        """Returns an object's path along the helix, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        Args:
            times: absolute times, shape (n,) [s], before or after the anchor's.
            period: time of one frame [s].
        """
        n = (times - self.time) / (self.baseline * period)
        tangents = rotated(self.chord, self.turn, n + 0.5)
        yaw = np.arctan2(tangents[:, 1], tangents[:, 0]) if self.s_0 > 0.0 else np.full(len(n), self.heading)
        return np.column_stack([self.anchor + displacement(self.chord, self.turn, n), np.unwrap(yaw)])


AT_REST = Helix(read_only(np.zeros(3)), 0.0, read_only(np.zeros(3)), read_only(np.zeros(3)))
"""The helix of an object at rest at the origin."""


def _split(chord: np.ndarray, turn: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Returns (angle, part of a chord along the axis, part across it, axis x part across it)."""
    angle = math.sqrt(float(turn @ turn))
    if angle < 1e-9:
        return 0.0, chord, np.zeros(3), np.zeros(3)
    axis = turn / angle
    along = axis * float(axis @ chord)
    across = chord - along
    return angle, along, across, np.cross(axis, across)


def rotated(chord: np.ndarray, turn: np.ndarray, n: ArrayLike) -> np.ndarray:
    """Returns a chord rotated by n turns, shape (len(n), 3); n are any real numbers."""
    angle, along, across, normal = _split(chord, turn)
    angles = angle * np.asarray(n, dtype=float)[:, None]
    return along + np.cos(angles) * across + np.sin(angles) * normal


def displacement(chord: np.ndarray, turn: np.ndarray, n: ArrayLike) -> np.ndarray:
    """Returns the sum of the next n chords, shape (len(n), 3) [m]: the translation of the n-th power of T_delta.

    For an integer n it is the sum of R^j chord over j = 1..n. The part along the axis grows with n, the part across it
    is the arc of `delta_power`; so it is exact on a helix, for fractional and negative n too.

    Args:
        chord: the last chord, shape (3,) [m].
        turn: rotation vector of R, shape (3,) [rad].
        n: any real numbers; negative ones lead into the past.
    """
    n = np.asarray(n, dtype=float)[:, None]
    angle, along, across, normal = _split(chord, turn)
    if angle == 0.0:
        return n * along
    half = 0.5 * angle
    grown, middle = np.sin(n * half) / math.sin(half), (n + 1.0) * half
    return n * along + grown * (np.cos(middle) * across + np.sin(middle) * normal)


def length_along(chord: np.ndarray, turn: np.ndarray) -> float:
    """Returns the length of the helix along a chord [m]."""
    angle, along, across, _ = _split(chord, turn)
    longer = 1.0 if angle == 0.0 else 0.5 * angle / math.sin(0.5 * angle)
    return math.hypot(float(np.linalg.norm(along)), longer * float(np.linalg.norm(across)))


def frenet_angles(chord: np.ndarray, turn: np.ndarray) -> tuple[float, float]:
    """Returns bending phi, from 0 to pi, and torsion psi, both between chord frames [rad].

    phi is the angle between two successive chords, psi the angle between the planes of two successive pairs of chords.
    """
    before, now, after = rotated(chord, turn, [-1.0, 0.0, 1.0])
    earlier, later = np.cross(before, now), np.cross(now, after)
    length = float(np.linalg.norm(now))
    phi = math.atan2(float(np.linalg.norm(later)), float(now @ after))
    psi = math.atan2(float(now @ np.cross(earlier, later)), length * float(earlier @ later))
    return phi, psi


def delta_transform_in_space(s: float, phi: float, psi: float) -> np.ndarray:
    """Returns T_delta = Rot(x, psi) Rot(z, phi) Trans(x, s), shape (4, 4), with both angles of a Frenet frame.

    The frame has its x axis along the chord and its z axis along the binormal. Without torsion it is `delta_transform`
    without climb.

    Args:
        s: arc length [m].
        phi: bending [rad].
        psi: torsion [rad].
    """
    transform = np.eye(4)
    transform[:3, :3] = (Rotation.from_rotvec([psi, 0.0, 0.0]) * Rotation.from_rotvec([0.0, 0.0, phi])).as_matrix()
    transform[:3, 3] = s * transform[:3, 0]
    return transform
