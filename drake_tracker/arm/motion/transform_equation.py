"""The transform equation (Allen et al. 1991, figure 11).

Two chains of transforms lead from the world W to the grasping position G::

    Base . T6 . Tool . Drive  =  Obj . Grasp
    X_WS   X_SM  X_MT   X_TG      X_WO   X_OG

Base (W to the shoulder S), Tool (joint 6's frame M to the tool T) and Grasp (the object O to G) are known; Obj comes
from vision through the servo, and T6 from the joints. The equation is solved for Drive when a motion begins. Drive then
shrinks to the identity while Obj keeps moving, and the equation is solved for Base . T6 . Tool, the pose of the tool,
from which inverse kinematics computes the joints: the hand moves straight to G *as seen from the object*.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

RAMP = 0.25
"""Fraction of a motion's time spent on speeding up, and the same fraction on slowing down."""
PEAK_OVER_MEAN = 1.0 / (1.0 - RAMP)
"""Ratio of the largest to the mean speed of a motion."""
START_BEND = 3.95
"""Largest deceleration of the part of a motion that removes an initial speed, in units of that speed over its time."""


@dataclass(frozen=True)
class Drive:
    """X_TG as a straight line.

    The translation is expressed in W, so that a hand that is far away does not swing about an object that turns. The
    turn is not wrapped, so that the hand unwinds in the right direction instead of the shortest one.

    Attributes:
        translation: p_TG_W, shape (3,) [m].
        turn: angle from x_T to x_G about z_W [rad].
    """

    translation: np.ndarray
    turn: float


def solve_drive(p_WT: np.ndarray, yaw_T: float, p_WG: np.ndarray, yaw_G: float) -> Drive:
    """Solves the transform equation for Drive, with tool and grasping frame both pointing down.

    Args:
        p_WT: position of T in W, shape (3,) [m].
        yaw_T: direction of x_T in W, continuous [rad].
        p_WG: position of G in W, shape (3,) [m].
        yaw_G: direction of x_G in W, continuous [rad].
    """
    return Drive(np.asarray(p_WG) - np.asarray(p_WT), yaw_G - yaw_T)


def apply_drive(drive: Drive, p_WG: np.ndarray, yaw_G: float) -> tuple[np.ndarray, float]:
    """Solves the transform equation for the tool.

    Args:
        drive: the value that Drive must have.
        p_WG: position of G in W, shape (3,) [m].
        yaw_G: direction of x_G in W, continuous [rad].

    Returns:
        p_WT, shape (3,) [m], and the direction of x_T in W [rad].
    """
    return np.asarray(p_WG) - drive.translation, yaw_G - drive.turn


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
    slope = duration * (t - t**3 * (6.0 - 8.0 * t + 3.0 * t**2))
    return Drive(value * start.translation + slope * rate.translation, value * start.turn + slope * rate.turn)


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


def tool_down_rotation(yaw: float) -> np.ndarray:
    """Returns the 3x3 rotation R_WT of a tool that points down with x_T at ``yaw`` [rad] from x_W."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
