"""The transform equation (Allen et al. 1991, figure 11).

Two chains of transforms lead from the world W to the grasping position G::

    Base . T6 . Tool . Drive  =  Obj . Grasp
    X_WS   X_SM  X_MT   X_TG      X_WO   X_OG

Base (W to the shoulder S), Tool (joint 6's frame M to the tool T) and Grasp (the object O to G) are known; Obj comes
from vision through the servo, and T6 from the joints. The equation is solved for Drive when a motion begins. Drive then
shrinks to the identity while Obj keeps moving, and the equation is solved for Base . T6 . Tool, the pose of the tool,
from which inverse kinematics computes the joints: the hand moves straight to G *as seen from the object*.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

RAMP = 0.25
"""Fraction of a motion's time spent on speeding up, and the same fraction on slowing down."""
PEAK_OVER_MEAN = 1.0 / (1.0 - RAMP)
"""Ratio of the largest to the mean speed of a motion."""
START_BEND = 3.95
"""Largest deceleration of the part of a motion that removes an initial speed, in units of that speed over its time."""
SLOWEST = 0.03
"""Horizontal speed [m/s] below which a velocity does not tell the slope of a path."""
STEEPEST = math.tan(math.radians(20.0))
"""Largest slope that the tool follows; tracks and belts are not as steep."""
LEVEL = (0.0, 0.0)
"""The slope of a level surface."""


@dataclass(frozen=True)
class Drive:
    """X_TG as a straight line.

    The translation is expressed in W, so that a hand that is far away does not swing about an object that turns. The
    turn is not wrapped, so that the hand unwinds in the right direction instead of the shortest one.

    Attributes:
        translation: p_TG_W, shape (3,) [m].
        turn: angle from x_T to x_G about z_W [rad].
        slope: slope at G minus the slope of the tool, shape (2,); see `surface_normal`.
    """

    translation: np.ndarray
    turn: float
    slope: np.ndarray = field(default_factory=lambda: np.zeros(2))


Slope = np.ndarray | Sequence[float]
"""Height gained along x_W and along y_W, per metre, shape (2,)."""


def solve_drive(
    p_WT: np.ndarray, yaw_T: float, p_WG: np.ndarray, yaw_G: float, slope_T: Slope = LEVEL, slope_G: Slope = LEVEL
) -> Drive:
    """Solves the transform equation for Drive, with tool and grasping frame both pointing down onto a surface.

    Args:
        p_WT: position of T in W, shape (3,) [m].
        yaw_T: direction of x_T in W, continuous [rad].
        p_WG: position of G in W, shape (3,) [m].
        yaw_G: direction of x_G in W, continuous [rad].
        slope_T: slope of the surface to which the tool is square.
        slope_G: slope of the surface at G.
    """
    return Drive(np.asarray(p_WG) - np.asarray(p_WT), yaw_G - yaw_T, np.subtract(slope_G, slope_T))


def apply_drive(
    drive: Drive, p_WG: np.ndarray, yaw_G: float, slope_G: Slope = LEVEL
) -> tuple[np.ndarray, float, np.ndarray]:
    """Solves the transform equation for the tool.

    Args:
        drive: the value that Drive must have.
        p_WG: position of G in W, shape (3,) [m].
        yaw_G: direction of x_G in W, continuous [rad].
        slope_G: slope of the surface at G.

    Returns:
        p_WT, shape (3,) [m], the direction of x_T in W [rad], and the slope to which the tool is square.
    """
    return np.asarray(p_WG) - drive.translation, yaw_G - drive.turn, slope_G - drive.slope


def shrink_drive(start: Drive, rate: Drive, fraction: float, duration: float) -> Drive:
    """Returns Drive during a straight-line motion.

    Its value follows `share_done`. Its rate at the start decays by a quintic, so that one motion leads into the next
    without a jump of speed. Value and rate are both zero at the end.

    Args:
        start: value of Drive when the motion began.
        rate: rate of Drive when the motion began, per second.
        fraction: completed fraction of the motion's time, 0 to 1.
        duration: duration of the motion [s].
    """
    t = min(max(fraction, 0.0), 1.0)
    value = 1.0 - share_done(t)
    onset = duration * (t - t**3 * (6.0 - 8.0 * t + 3.0 * t**2))
    return Drive(
        value * start.translation + onset * rate.translation,
        value * start.turn + onset * rate.turn,
        value * start.slope + onset * rate.slope,
    )


def share_done(fraction: float) -> float:
    """Returns the completed share of a straight line after a fraction (0 to 1) of its time.

    The speed is a trapezoid with ramps of `RAMP` each. Its peak is 1.33 times the mean, against 1.88 for a quintic: the
    arm's slowest joint limits how fast the hand comes down.
    """
    t = min(max(fraction, 0.0), 1.0)
    peak = PEAK_OVER_MEAN
    if t < RAMP:
        return peak * t * t / (2.0 * RAMP)
    if t > 1.0 - RAMP:
        return 1.0 - peak * (1.0 - t) ** 2 / (2.0 * RAMP)
    return peak * (t - 0.5 * RAMP)


def motion_time(length: float, against: float, speed: float, acceleration: float) -> float:
    """Returns the shortest duration [s] of a straight-line motion within limits of speed and acceleration.

    Args:
        length: length of the line [m].
        against: speed at its start that does not point towards its end [m/s].
        speed: largest speed [m/s].
        acceleration: largest acceleration [m/s^2].
    """
    kill, ramp = START_BEND * against, PEAK_OVER_MEAN / RAMP * length
    change = (kill + np.sqrt(kill**2 + 4.0 * acceleration * ramp)) / (2.0 * acceleration)
    return max(PEAK_OVER_MEAN * length / speed, change)


def straight_motion_time(displacement: np.ndarray, v_start: np.ndarray, speed: float, acceleration: float) -> float:
    """Returns the shortest duration [s] of a straight-line motion that begins with some velocity; see `motion_time`.

    Args:
        displacement: of the motion, shape (3,) [m].
        v_start: velocity at its start, shape (3,) [m/s].
        speed: largest speed [m/s].
        acceleration: largest acceleration [m/s^2].
    """
    length: Any = np.linalg.norm(displacement)
    along = max(v_start @ displacement, 0.0) * displacement / max(length, 1e-9) ** 2
    against: Any = np.linalg.norm(v_start - along)
    return motion_time(length, against, speed, acceleration)


def surface_normal(slope: Slope) -> np.ndarray:
    """Returns the unit normal in W, shape (3,), of a surface with a slope; (0, 0, 1) if it is level."""
    return np.array([-slope[0], -slope[1], 1.0]) / math.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)


def slope_along(v: np.ndarray, otherwise: Slope) -> np.ndarray:
    """Returns the slope of a surface that contains a path and is level across it, at most `STEEPEST`.

    Args:
        v: velocity along the path in W, shape (3,) [m/s].
        otherwise: the slope of a path that is too slow (`SLOWEST`) to tell.
    """
    speed = math.hypot(v[0], v[1])
    if speed < SLOWEST:
        return np.array(otherwise)
    return min(max(v[2] / speed, -STEEPEST), STEEPEST) * v[:2] / speed


def tool_down_rotation(yaw: float, slope: Slope = LEVEL) -> np.ndarray:
    """Returns the 3x3 rotation R_WT of a tool that points down onto a surface.

    Args:
        yaw: angle from x_W to x_T, seen from above [rad].
        slope: of the surface, to which the tool is square.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    if not np.any(slope):
        return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    x_T, z_T = np.array([c, s, c * slope[0] + s * slope[1]]), -surface_normal(slope)
    x_T /= np.linalg.norm(x_T)
    return np.column_stack([x_T, np.cross(z_T, x_T), z_T])
