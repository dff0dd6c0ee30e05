"""The transform equation (Allen et al. 1991, figure 11).

Two chains of transforms lead from the world W to the grasping position G::

    Base . T6 . Tool . Drive  =  Obj . Grasp
    X_WS   X_SM  X_MT   X_TG      X_WO   X_OG

Base (W to the shoulder S), Tool (joint 6's frame M to the tool T) and Grasp (the object O to G) are known, Obj comes
from vision by way of the servo, T6 from the joints. The equation is solved for Drive when a motion begins. Drive is
then shrunk to the identity while Obj keeps moving, and the equation is solved for Base . T6 . Tool, the tool's pose,
from which inverse kinematics finds the joints: the hand goes straight to G *as seen from the object*.
"""

from dataclasses import dataclass

import numpy as np

RAMP = 0.25
"""Share of a motion's time spent on speeding up, and the same on slowing down."""
PEAK_OVER_MEAN = 1.0 / (1.0 - RAMP)
"""Greatest over mean speed of a motion."""
START_BEND = 3.95
"""Greatest deceleration of the part of a motion that kills a speed, over that speed and the motion's time."""


@dataclass(frozen=True)
class Drive:
    """X_TG as a straight line: p_TG_W [m], and the turn from T to G about z_W [rad].

    The translation is expressed in W, so that a hand still far away does not swing about an object that turns. The turn
    keeps its full turns, so that the hand unwinds the way it should instead of the shortest way.
    """

    translation: np.ndarray
    turn: float


def solve_drive(p_WT, yaw_T, p_WG, yaw_G):
    """Solves the transform equation for Drive, for tool and grasping frame both pointing down.

    Args:
      p_WT, p_WG: positions of T and G in W [m], shape (3,).
      yaw_T, yaw_G: continuous directions of x_T and x_G in W [rad].
    """
    return Drive(np.asarray(p_WG) - np.asarray(p_WT), yaw_G - yaw_T)


def apply_drive(drive, p_WG, yaw_G):
    """Solves the transform equation for the tool: returns (p_WT, yaw_T) at which Drive has the given value."""
    return np.asarray(p_WG) - drive.translation, yaw_G - drive.turn


def shrink_drive(start, rate, fraction, duration):
    """Returns Drive after a ``fraction`` (0 to 1) of a straight-line motion.

    ``start`` and ``rate`` (per second) are its value and its rate when the motion began. The value follows
    `share_done`; the rate at the start dies away by a quintic, so that one motion leads into the next without a jump of
    speed, and both are zero at the end.
    """
    t = min(max(fraction, 0.0), 1.0)
    value = 1.0 - share_done(t)
    slope = duration * (t - t**3 * (6.0 - 8.0 * t + 3.0 * t**2))
    return Drive(value * start.translation + slope * rate.translation, value * start.turn + slope * rate.turn)


def share_done(fraction):
    """Returns how much of a straight line is done after a ``fraction`` (0 to 1) of its time.

    The speed is a trapezoid with ramps of `RAMP` each: its peak is 1.33 times the mean, which a quintic's 1.88 is not,
    and the arm's slowest joint decides how fast the hand comes down.
    """
    t = min(max(fraction, 0.0), 1.0)
    peak = PEAK_OVER_MEAN
    if t < RAMP:
        return peak * t * t / (2.0 * RAMP)
    if t > 1.0 - RAMP:
        return 1.0 - peak * (1.0 - t) ** 2 / (2.0 * RAMP)
    return peak * (t - 0.5 * RAMP)


def motion_time(way, against, speed, acceleration):
    """Returns the shortest time [s] of a straight-line motion within a greatest speed [m/s] and acceleration [m/s^2].

    ``way``: its length [m]. ``against``: the speed [m/s] at its start that does not point to its end.
    """
    kill, ramp = START_BEND * against, PEAK_OVER_MEAN / RAMP * way
    change = (kill + np.sqrt(kill**2 + 4.0 * acceleration * ramp)) / (2.0 * acceleration)
    return max(PEAK_OVER_MEAN * way / speed, change)


def tool_down_rotation(yaw):
    """Returns the 3x3 rotation R_WT of a tool that points down with x_T at ``yaw`` [rad] from x_W."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
