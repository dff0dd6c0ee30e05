"""The rail of a track with heights: it carries the train as well, and holds it along a slope and a bank.

On a level track the table carries the train. A track with heights is an embankment without a collision shape; instead
the rail pushes the wheels along the normal of the track, and never pulls.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix

from drake_tracker.world.train.rail import (
    DRIVE_GAIN,
    LATERAL_DAMPING,
    LATERAL_LIMIT,
    LATERAL_STIFFNESS,
    LIFT_RANGE,
    REACH_RANGE,
    TILT_RANGE,
    YAW_DAMPING,
    YAW_LIMIT,
    YAW_STIFFNESS,
    Held,
    Load,
    clipped,
    driven_speed,
    faded,
    held_on_rail,
)
from drake_tracker.world.train.tracks import Track

TRAIN_HEIGHT = 0.035
"""Height of the train's reference point O, the centre of its body, above the track along its normal [m]."""
MASS, GRAVITY = 0.25, 9.81
"""Mass of a train of scale 1 [kg], and acceleration of gravity [m/s^2]."""
FRICTION = 0.35
"""Of wheels on rails: the drive pulls at most this share of the weight; chosen, for rubber tyres on brass."""
NORMAL_STIFFNESS, NORMAL_DAMPING = 5000.0, 70.0
"""Of the rail along its normal [N/m], [N s/m]; critical for the mass of the train."""
TILT_LIMIT = 0.12
"""Torque that four wheels on the rails can give, the weight times half a wheelbase [N m]."""


class HeldInSpace(NamedTuple):
    """How the rail of a track with heights holds a train.

    Attributes:
        grip: share of the forces that act.
        place: arc length at which the rail holds the train [m].
        frame: rows along the track, to its left, and along its normal, shape (3, 3), in W.
        offset: from the track to the train's reference point, along these rows, shape (3,) [m].
        axes: rows are the train's x, y and z axes, shape (3, 3), in W.
        turning: rate of the heading along the track seen from above, per metre travelled [rad/m].
    """

    grip: float
    place: float
    frame: np.ndarray
    offset: np.ndarray
    axes: np.ndarray
    turning: float


def track_frame(tangent_x: float, tangent_y: float, slope: float, lean: float) -> np.ndarray:
    """Returns the frame of a track: rows along it, to its left, and along its normal, shape (3, 3), in W.

    Args:
        tangent_x: horizontal direction of travel, of unit length.
        tangent_y: the same.
        slope: height gained per metre of the plan.
        lean: angle by which the track leans to the left [rad].
    """
    along = np.array([tangent_x, tangent_y, slope]) / math.sqrt(1.0 + slope * slope)
    level = np.array([-tangent_y, tangent_x, 0.0])
    upright = np.cross(along, level)
    left = math.cos(lean) * level - math.sin(lean) * upright
    return np.stack([along, left, np.cross(along, left)])


def held_on_hill(
    track: Track, state: Sequence[float], height: float, near: float = math.nan, turns: bool = True
) -> HeldInSpace | None:
    """Returns how the rail of a track with heights holds a train, None off the rail; arguments as `held_on_rail`.

    ``height`` is z_W of O while the train stands where the track is on the table.
    """
    quaternion = np.array(state[:4])
    axes = RotationMatrix(Quaternion(quaternion / np.linalg.norm(quaternion))).matrix().T
    x_W, y_W, z_W = np.array(state[4:7]) - TRAIN_HEIGHT * axes[2]  # of the foot of the train
    heading = axes[0, :2] / max(math.hypot(*axes[0, :2]), 1e-9) if turns else np.zeros(2)
    s, lateral, tangent_x, tangent_y, curvature = track.locate(x_W, y_W, heading[0], heading[1], near)
    above, slope, lean = map(float, track.profile(s))
    frame = track_frame(tangent_x, tangent_y, slope, lean)
    table = height - TRAIN_HEIGHT
    offset = frame @ [-lateral * tangent_y, lateral * tangent_x, z_W - table - above]
    grip = faded(float(offset[2]), LIFT_RANGE) * faded(float(axes[2] @ frame[2]), TILT_RANGE)
    grip *= faded(abs(float(offset[1])), REACH_RANGE)
    return HeldInSpace(grip, s, frame, offset, axes, curvature) if grip > 0.0 else None


def held_on_track(
    track: Track, state: Sequence[float], height: float, near: float = math.nan, turns: bool = True
) -> Held | HeldInSpace | None:
    """Returns how the rail of a level track, or of a track with heights, holds a train; see `held_on_rail`."""
    return (held_on_rail if track.heights is None else held_on_hill)(track, state, height, near, turns)


def hill_force(
    track: Track,
    held: HeldInSpace | None,
    state: Sequence[float],
    target_speed: float,
    load: Load = Load(),
    turns: bool = True,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the force at the train's reference point [N] and the torque [N m], both of shape (3,), in W.

    The forces are those of `rail_force` in the frame of the track, and besides: the rail carries the weight, the drive
    adds what the slope takes, within the friction of the wheels, and springs hold the train's z axis along the normal.

    Args:
        track: travelled in the direction of growing arc length.
        held: as from `held_on_hill`.
        state: as for `held_on_hill`.
        target_speed: speed along the track, negative backwards [m/s].
        load: the body of the train.
        turns: whether the train's x axis is drawn along the track; otherwise along x_W.
    """
    if held is None:
        return np.zeros(3), np.zeros(3)
    along, _, normal = held.frame
    turning, velocity = np.array(state[7:10]), held.frame @ np.array(state[10:13])
    weight = MASS * GRAVITY * held.frame[:, 2]
    most = FRICTION * weight[2]
    drive = DRIVE_GAIN * (driven_speed(track, held.place, target_speed, load) - float(velocity[0]))
    drive = clipped(drive + float(weight[0]), most)
    side = -LATERAL_STIFFNESS * float(held.offset[1]) - LATERAL_DAMPING * float(velocity[1])
    side = clipped(side + float(weight[1]), LATERAL_LIMIT)
    carry = float(weight[2]) - NORMAL_STIFFNESS * float(held.offset[2]) - NORMAL_DAMPING * float(velocity[2])
    push = np.array([drive, side, max(carry, 0.0)]) @ held.frame

    goal = along if turns else np.array([1.0, 0.0, 0.0])
    goal = goal - normal * float(goal @ normal)
    error = math.atan2(float(normal @ np.cross(held.axes[0], goal)), float(held.axes[0] @ goal))
    rate = held.turning * float(velocity[0]) if turns else 0.0
    spin = clipped(YAW_STIFFNESS * error + YAW_DAMPING * (rate - float(turning @ normal)), YAW_LIMIT)
    tilting = turning - normal * float(turning @ normal)
    upright = YAW_STIFFNESS * np.cross(held.axes[2], normal) - YAW_DAMPING * tilting
    upright = upright * min(1.0, TILT_LIMIT / max(float(np.linalg.norm(upright)), 1e-12))
    force = held.grip * load.mass * push
    return force, held.grip * load.mass * load.turning * (spin * normal + upright)
