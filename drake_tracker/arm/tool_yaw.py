"""Which way round the jaws go: joint 6 follows the path's tangent and is unwound before its range ends.

One lap turns the tangent by 360 deg, and joint 6 has 532 deg. The jaws are symmetric, so that half a turn of the hand
changes nothing about the grasp: the *branch* is the number of half turns added to the tangent's direction.
"""

import math

from drake_tracker.arm.transform_equation import PEAK_OVER_MEAN

FLIP_ANGLE = math.radians(109.0)
"""Joint 6 angle [rad] at which the jaws turn over. Past it half a turn back lands nearer the middle of the range."""
FLIP_SPEED = 5.0
"""Speed [rad/s] that turning over may ask of joint 6, whose rating is 5.74."""


def best_branch(q6, tool_yaw, object_yaw):
    """Returns the branch that brings joint 6 nearest to zero: pointing down, it turns the tool against z_W.

    Args:
      q6: joint 6 [rad] now, with the tool pointing down and its x axis at ``tool_yaw``.
      tool_yaw, object_yaw: directions in W [rad], both continuous (not wrapped).
    """
    return round((q6 + tool_yaw - object_yaw) / math.pi)


def nearest_whole_turn(tool_yaw, object_yaw):
    """Returns the branch, an even number of half turns, that turns a hand without symmetry the least."""
    return 2 * round((tool_yaw - object_yaw) / (2.0 * math.pi))


def must_flip(q6):
    """Whether joint 6 [rad] has gone so far that the jaws should turn over."""
    return abs(q6) > FLIP_ANGLE


def flip_duration(half_turns, yaw_rate):
    """Returns the time [s] in which the jaws turn over by ``half_turns`` while the path turns at ``yaw_rate`` [rad/s].

    Turning over mostly unwinds what the path has wound up, and joint 6 feels the difference of the two: that is not
    counted on, for the path may straighten meanwhile. Where the path has begun to bend the other way it feels their
    sum.
    """
    allowed = FLIP_SPEED - max(math.copysign(1.0, half_turns) * yaw_rate, 0.0)
    return PEAK_OVER_MEAN * math.pi * abs(half_turns) / max(allowed, 0.5 * FLIP_SPEED)
