"""A law that says beforehand how often a grasp of a moving object succeeds.

The arm relies on a prediction for a *horizon*: the lag of vision, and the time in which the hand can no longer follow
new measurements. A grasp succeeds if, within that horizon, the object leaves its predicted path by no more than the
jaws tolerate, and if the arm can follow.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.differential_ik import EFFORT_SHARE, SPEED_SHARE

TURN = math.radians(22.0)
"""Error of the direction at which half of the trains are lifted (`descent.OBLIQUE`)."""
_DIRECTIONS = np.linspace(0.0, np.pi, 16, endpoint=False)


class ArmLimits(NamedTuple):
    """What a hand that points down can do, in the horizontal direction in which it can do least.

    Attributes:
        speed: largest speed [m/s].
        turn: largest rate of turn about the vertical [rad/s].
        acceleration: largest acceleration [m/s^2].
    """

    speed: float
    turn: float
    acceleration: float


def arm_limits(model: ArmModel, q: np.ndarray) -> ArmLimits:
    """Returns the limits of an arm that follow from the rated speeds and torques of its joints.

    Args:
        model: the arm.
        q: joints with the hand over the middle of the table [rad], shape (n,).
    """
    inverse = np.linalg.pinv(model.tool_pose_and_jacobian(q)[1])
    rest = np.zeros(model.num_joints)
    held = model.drive_torques(q, rest, rest)
    speed, spare = SPEED_SHARE * model.velocity_limit, EFFORT_SHARE * (model.effort_limit - np.abs(held))

    def least(limits: np.ndarray, needed: np.ndarray) -> float:
        return float(np.min(limits / np.maximum(np.abs(needed), 1e-9)))

    ways = [inverse @ [0.0, 0.0, 0.0, math.cos(angle), math.sin(angle), 0.0] for angle in _DIRECTIONS]
    return ArmLimits(
        min(least(speed, way) for way in ways),
        least(speed, inverse @ [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        min(least(spare, model.drive_torques(q, rest, way) - held) for way in ways),
    )


def strays(curvature: np.ndarray, step: float, distance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns where a path is, a distance ahead, relative to an arc that continues it at each of its places.

    Args:
        curvature: of the path at places ``step`` [m] apart, from one to the next [1/m], shape (n,).
        step: distance between the places [m].
        distance: from each place to the place ahead [m].

    Returns:
        Offsets of the arc's end across the path and along it [m], and in direction [rad], shape (m,): places less than
        ``distance`` from the end of the path are left out.
    """
    heading = np.append(0.0, np.cumsum(curvature)) * step
    middle = 0.5 * (heading[1:] + heading[:-1])
    path = np.append(0.0, np.cumsum(step * np.exp(1j * middle)))
    travelled = step * np.arange(len(path))
    starts = np.flatnonzero(travelled[:-1] + distance <= travelled[-1])
    ends = travelled[starts] + distance
    there = np.interp(ends, travelled, path.real) + 1j * np.interp(ends, travelled, path.imag)
    direction = np.interp(ends, travelled, heading)
    turn = curvature[starts] * distance
    chord = distance * np.sinc(0.5 * turn / np.pi) * np.exp(1j * (heading[starts] + 0.5 * turn))
    offset = (path[starts] + chord - there) * np.exp(-1j * direction)
    difference = heading[starts] + turn - direction
    return offset.imag, offset.real, np.arctan2(np.sin(difference), np.cos(difference))
