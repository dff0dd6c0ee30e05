"""Direction of the jaws: joint 6 follows the path's tangent, and unwinds before its range ends.

One lap turns the tangent by 360 deg, and joint 6 has a range of 532 deg. The jaws are symmetric, so that half a turn of
the hand does not change the grasp: the *branch* is the number of half turns added to the tangent's direction.
"""

import math

import numpy as np

from drake_tracker.arm.motion.transform_equation import PEAK_OVER_MEAN

FLIP_ANGLE = math.radians(109.0)
"""Joint 6 angle [rad] at which the jaws flip. Beyond it, half a turn back ends nearer to the middle of the range."""
FLIP_SPEED = 5.0
"""Speed [rad/s] of joint 6 that a flip may use; its rated speed is 5.74 rad/s."""
WOUND_UP = 0.8
"""Share of a flip that the path may wind up again. Beyond it, the flip counts on the path to go on turning."""
FLIP_SHARE = 0.9
"""Fraction of the rated speed of a slower last joint that a flip may use."""


def best_branch(q6: float, tool_yaw: float, object_yaw: float) -> int:
    """Returns the branch that brings joint 6 nearest to zero: pointing down, it turns the tool against z_W.

    Args:
        q6: joint 6 [rad], with the tool pointing down and its x axis at ``tool_yaw``.
        tool_yaw: direction of x_T in W, continuous [rad].
        object_yaw: direction of the object in W, continuous [rad].
    """
    return round((q6 + tool_yaw - object_yaw) / math.pi)


def swing_about_base(p_WT: np.ndarray, p_WR: np.ndarray) -> float:
    """Returns by how much the first joint turns [rad] while the tool moves from one place to another, the short way.

    The base stands at W's origin, and its joint turns about z_W. Each radian turns the last joint by one radian, if the
    direction of the tool in W does not change.

    Args:
        p_WT: where the tool is, at least (x, y) [m].
        p_WR: where it goes, at least (x, y) [m].
    """
    (x, y), (x_R, y_R) = p_WT[:2], p_WR[:2]
    return math.remainder(math.atan2(y_R, x_R) - math.atan2(y, x), 2.0 * math.pi)


def nearest_whole_turn(tool_yaw: float, object_yaw: float) -> int:
    """Returns the branch, an even number of half turns, that turns a hand without symmetry the least.

    Args:
        tool_yaw: direction of x_T in W, continuous [rad].
        object_yaw: direction of the object in W, continuous [rad].
    """
    return 2 * round((tool_yaw - object_yaw) / (2.0 * math.pi))


def must_flip(q6: float) -> bool:
    """Returns whether joint 6 [rad] has turned so far that the jaws should flip."""
    return abs(q6) > FLIP_ANGLE


def flip_speed(rated: float) -> float:
    """Returns the speed [rad/s] that a flip may use with a last joint of a rated speed [rad/s]."""
    return min(FLIP_SPEED, FLIP_SHARE * rated)


def flip_duration(half_turns: float, yaw_rate: float, speed: float = FLIP_SPEED) -> float:
    """Returns the time [s] in which the jaws flip.

    A flip mostly unwinds what the path has wound up, so that joint 6 turns with the difference of the two speeds. The
    path may straighten meanwhile, hence this shortens the flip only where the path would wind up almost as much during
    the flip: on a small circle the jaws would flip for ever. Where the path has begun to bend the other way, joint 6
    turns with the sum of the two speeds, and the flip takes longer.

    Args:
        half_turns: half turns of the flip, positive about z_W.
        yaw_rate: turning rate of the path [rad/s].
        speed: of the last joint that the flip may use [rad/s].
    """
    wound = -math.copysign(1.0, half_turns) * yaw_rate
    allowed = speed + (wound if PEAK_OVER_MEAN * wound > WOUND_UP * speed else min(wound, 0.0))
    return PEAK_OVER_MEAN * math.pi * abs(half_turns) / max(allowed, 0.4 * speed)
