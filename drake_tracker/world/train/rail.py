"""The rail: the forces that guide and drive a train, which is otherwise a free body."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from drake_tracker.world.config import TRAIN_SIZE, body_size
from drake_tracker.world.train.tracks import Track

LATERAL_STIFFNESS = 2000.0  # [N/m]
LATERAL_DAMPING = 45.0  # [N s/m] critical for .25 kg
LATERAL_LIMIT = 8.0  # [N] what the wheels' flanges hold
YAW_STIFFNESS = 6.0  # [N m/rad]
YAW_DAMPING = 0.06  # [N m s/rad] 0.7 of critical for 3.3e-4 kg m^2, and stable at a step of 1/300 s
YAW_LIMIT = 0.8  # [N m] the flanges' force, front and rear, at a wheelbase of .1 m
DRIVE_GAIN = 60.0  # [N s/m] loses 0.8 mm/s to a drag of .05 N; above .25 kg / (1/300 s) = 75 the motion is jerky
DRIVE_LIMIT = 0.6  # [N]
BRAKING = 0.5  # [m/s^2] at the end of an open track
END_MARGIN = 0.06  # [m] half a train: its nose stays on the rails
CUBE_MASS = 0.2  # of a cube of scale 1, relative to the mass of a train of scale 1 (models train)

# The rail holds fully up to the first number and not at all from the second on.
LIFT_RANGE = (0.002, 0.004)  # [m] of height above the rail
TILT_RANGE = (0.985, 0.966)  # cosine: 10 and 15 deg
REACH_RANGE = (0.02, 0.03)  # [m] beside the rail: a train set down elsewhere is not drawn back onto it


class Held(NamedTuple):
    """How the rail holds a train.

    Attributes:
        grip: share of the forces that act.
        heading_x: x component of the train's heading.
        heading_y: y component.
        located: the train on the track, as from `Track.locate`.
    """

    grip: float
    heading_x: float
    heading_y: float
    located: tuple[float, float, float, float, float]

    @property
    def place(self) -> float:
        """Arc length at which the rail holds the train [m]."""
        return self.located[0]


class Load(NamedTuple):
    """A body on the rail. The forces grow with its mass and the torque with its moment of inertia, so that every body
    moves alike.

    Attributes:
        half_length: half of its length [m].
        mass: relative to a train of scale 1.
        turning: its moment of inertia about z over its mass, relative to a train of scale 1.
    """

    half_length: float = END_MARGIN
    mass: float = 1.0
    turning: float = 1.0


def load_of(body: str, scale: float) -> Load:
    """Returns the body of a model on the rail.

    Args:
        body: which model, one of `TRAIN_BODIES`.
        scale: relative to the model.
    """
    length, width, _ = body_size(body, scale)
    mass = CUBE_MASS * scale**3 if body == "cube" else scale
    return Load(0.5 * length, mass, (length**2 + width**2) / (TRAIN_SIZE[0] ** 2 + TRAIN_SIZE[1] ** 2))


def driven_speed(track: Track, s: float, target_speed: float, load: Load) -> float:
    """Returns the speed [m/s] at which a train is driven at arc length ``s`` [m]: it stops at the ends of a track."""
    if track.closed:
        return target_speed
    remaining = max(track.length - load.half_length - s, 0.0)
    target_speed = min(target_speed, math.sqrt(2.0 * BRAKING * remaining))
    behind = max(s - load.half_length, 0.0)  # a train that runs backwards stays on the rails too
    return max(target_speed, -math.sqrt(2.0 * BRAKING * behind))


def rail_force(
    track: Track,
    held: Held | None,
    state: Sequence[float],
    target_speed: float,
    load: Load = Load(),
    turns: bool = True,
) -> tuple[float, float, float]:
    """Returns the force (x, y) [N] at the train's reference point O and the torque about z [N m], in W.

    Springs and dampers draw O onto the track and the train's x axis along it; the drive force is proportional to the
    speed error. Each is limited, and all fade out together as the train is lifted, tilted or carried aside. The
    spring supplies the centripetal force: 0.04 mm of offset at 0.2 m/s on a radius of 0.12 m.

    Args:
        track: travelled in the direction of growing arc length.
        held: as from `held_on_rail`.
        state: as for `held_on_rail`.
        target_speed: speed along the track, negative backwards [m/s].
        load: the body of the train.
        turns: whether the train's x axis is drawn along the track; otherwise along x_W.
    """
    if held is None:
        return 0.0, 0.0, 0.0
    grip, heading_x, heading_y, (s, lateral, tangent_x, tangent_y, curvature) = held
    wz, vx, vy = state[9:12]
    target_speed = driven_speed(track, s, target_speed, load)
    speed = vx * tangent_x + vy * tangent_y
    drift = vy * tangent_x - vx * tangent_y
    side = clipped(-LATERAL_STIFFNESS * lateral - LATERAL_DAMPING * drift, LATERAL_LIMIT)
    drive = clipped(DRIVE_GAIN * (target_speed - speed), DRIVE_LIMIT)
    goal_x, goal_y, goal_rate = (tangent_x, tangent_y, curvature * speed) if turns else (1.0, 0.0, 0.0)
    yaw_error = math.atan2(heading_x * goal_y - heading_y * goal_x, heading_x * goal_x + heading_y * goal_y)
    torque = clipped(YAW_STIFFNESS * yaw_error + YAW_DAMPING * (goal_rate - wz), YAW_LIMIT)
    push = grip * load.mass
    return (
        push * (drive * tangent_x - side * tangent_y),
        push * (drive * tangent_y + side * tangent_x),
        push * load.turning * torque,
    )


def held_on_rail(
    track: Track, state: Sequence[float], height: float, near: float = math.nan, turns: bool = True
) -> Held | None:
    """Returns how the rail holds a train, None off the rail.

    Args:
        track: travelled in the direction of growing arc length.
        state: the 13 numbers of a free body in W, as plain floats: quaternion w, x, y, z, position of O [m], angular
            velocity [rad/s], velocity of O [m/s].
        height: z_W of O while the train stands on the rail [m].
        near: arc length at which the rail held the train a moment ago, near which the track is searched [m]; NaN to
            search the whole track.
        turns: as for `rail_force`.
    """
    qw, qx, qy, qz, x, y, z = state[:7]
    # The plant does not keep the quaternion at unit length (it grows by 1e-3 a lap), so nothing here may rely on it.
    spin, tilt = qw * qw + qz * qz, qx * qx + qy * qy
    grip = faded(z - height, LIFT_RANGE) * faded((spin - tilt) / (spin + tilt), TILT_RANGE)
    if grip == 0.0:
        return None
    heading_x = qw * qw + qx * qx - qy * qy - qz * qz
    heading_y = 2.0 * (qx * qy + qw * qz)
    norm = math.hypot(heading_x, heading_y)
    heading_x, heading_y = heading_x / norm, heading_y / norm
    # Without a heading, only the distance and the last place tell one branch of the track from another.
    located = track.locate(x, y, heading_x, heading_y, near) if turns else track.locate(x, y, 0.0, 0.0, near)
    grip *= faded(abs(located[1]), REACH_RANGE)
    return Held(grip, heading_x, heading_y, located) if grip > 0.0 else None


def faded(value: float, value_range: tuple[float, float]) -> float:
    """Returns 1 up to the first value of a range, 0 from the second on, and a share between them."""
    full, none = value_range
    return min(max((none - value) / (none - full), 0.0), 1.0)


def clipped(value: float, limit: float) -> float:
    """Returns a value within -limit and limit."""
    return min(max(value, -limit), limit)
