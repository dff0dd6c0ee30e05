"""Holds parts that nothing can move, so that the plant need not compute their motion.

A part far upstream rides on the belt, a part that has left the belt lies in a box, and a part at rest in a cell sleeps
until the hand comes near. Their joints are locked in the parameters of a Context, which no event of Drake may change.
`SleepingParts` therefore works between two steps of a simulation. All of its memory is in the Context.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import BeltMotion
from drake_tracker.world.conveyor.conveyor_config import BeltConfig
from drake_tracker.world.conveyor.conveyor_plant import ConveyorLaboratory, start_pose
from drake_tracker.world.conveyor.part_fates import PartFate
from drake_tracker.world.imaging.cameras import ImageWindow

LIFT = 0.0005
"""Height above its place at which a part is held, so that it touches nothing [m]."""
BEFORE_ENTRY, BEYOND_END = 0.15, 0.30
"""Smallest length of the belt before its entry and beyond its end on which parts are free [m]."""
MARGIN = max(shape.radius for shape in PART_SHAPES.values()) + 0.05
"""Smallest distance of the middle of a part that is held from what the cameras see [m]."""
NEAR = 0.15
"""Distance from the fingers within which all parts are free [m]: more than the reach of a part that they carry, and the
way of the hand in one cycle."""
STILL = 1e-3
"""Largest velocity of a part that falls asleep, of its middle [m/s] and of a point 1 m beside it [rad/s]."""
ASTRAY = 0.01
"""Distance from its place on the belt beyond which a part is not held: something has moved it [m]."""
BOX_FROM_END, BOX_PITCH, BOX_COLUMNS = 0.7, 0.12, 3
"""Distance of the first row of the box from the end of the belt, distance between parts in it [m], and its columns."""
_HEIGHTS, _ACROSS, _STEP, _FARTHEST = (0.0, 0.05), 5, 0.01, 3.0
_X, _Y, _Z, _SPEED = 4, 5, 6, 4
"""Places of x, y and z among the positions of a part, and of its speed along y among its velocities."""


def free_stretch(
    belt: BeltConfig, cameras: Mapping[str, CameraModel], windows: Mapping[str, ImageWindow] | None = None
) -> tuple[float, float]:
    """Returns the first and the last y in W between which all parts on the belt are free bodies [m].

    It contains all of the belt that an image shows.

    Args:
        belt: where it lies.
        cameras: {name: camera} of the world; none when it renders no images.
        windows: {name: part of the image that is rendered}; None: the full images.
    """
    first, last = belt.entry - BEFORE_ENTRY, belt.end + BEYOND_END
    y = np.arange(-_FARTHEST, _FARTHEST, _STEP)
    across = belt.middle + np.linspace(-0.5, 0.5, _ACROSS) * belt.width
    places = np.array([[x, 0.0, belt.height + z] for x in across for z in _HEIGHTS])
    along = np.array([0.0, 1.0, math.tan(belt.frame.angle)])
    for name, camera in cameras.items():
        u0, v0, width, height = (0, 0, camera.width, camera.height) if windows is None else windows[name]
        for place in places:
            u, v = camera.project(place + np.outer(y, along)).T
            seen = y[(u >= u0 - 1) & (u <= u0 + width) & (v >= v0 - 1) & (v <= v0 + height)]
            if len(seen):
                first, last = min(first, seen[0] - MARGIN), max(last, seen[-1] + MARGIN)
    return float(first), float(last)


class SleepingParts:
    """Locks and frees the parts of a conveyor.

    - A part upstream of the free stretch rides at its place on the belt, `LIFT` above it. When the part reaches the
      visible stretch, the part is put down with the velocity of the belt, and freed.
    - A part that was missed is put into the box, on the floor, when it leaves the stretch.
    - A part that rests in a cell is locked where it is. It can still be touched.

    No part that is nearer to a finger than `NEAR` is held.

    Args:
        laboratory: with the plant.
        arrivals: its parts.
        belt: where the belt lies.
        motion: of the belt.
        stretch: the first and the last y of the free stretch, see `free_stretch` [m].
    """

    def __init__(
        self,
        laboratory: ConveyorLaboratory,
        arrivals: Sequence[Arrival],
        belt: BeltConfig,
        motion: BeltMotion,
        stretch: tuple[float, float],
    ) -> None:
        self._plant = plant = laboratory.plant
        self._first, self._last = stretch
        self._belt, self._fingers = laboratory.belt, laboratory.fingers
        self._joints = [plant.GetJointByName(body.name(), body.model_instance()) for body in laboratory.parts]
        self._q = np.array([joint.position_start() for joint in self._joints])[:, None] + np.arange(7)
        self._v = np.array([joint.velocity_start() for joint in self._joints])[:, None] + np.arange(6)
        poses = [start_pose(arrival, belt, motion) for arrival in arrivals]
        self._start = np.array([[*X_WP.rotation().ToQuaternion().wxyz(), *X_WP.translation()] for X_WP in poses])
        rows, columns = np.divmod(np.arange(len(arrivals)), BOX_COLUMNS)
        self._box = self._start.copy()
        self._box[:, _X] = belt.middle + (columns - 0.5 * (BOX_COLUMNS - 1)) * BOX_PITCH
        self._box[:, _Y] = belt.end + BOX_FROM_END + rows * BOX_PITCH
        self._box[:, _Z] += LIFT + laboratory.floor - belt.height - np.tan(belt.frame.angle) * self._start[:, _Y]
        self._along = np.array([math.cos(belt.frame.angle), math.sin(belt.frame.angle)])

    def update(self, context: Any, fates: np.ndarray) -> None:
        """Locks, moves and frees parts.

        Args:
            context: Context of the plant, between two steps.
            fates: the `PartFate` of each part, as numbers, shape (n,).
        """
        plant = self._plant
        q, v = plant.GetPositions(context), plant.GetVelocities(context)
        poses, velocities = q[self._q], v[self._v]
        locked = np.array([joint.is_locked(context) for joint in self._joints])
        upstream, missed, placed = (fates == fate for fate in (PartFate.UPSTREAM, PartFate.MISSED, PartFate.PLACED))

        (travelled,), (speed,) = (get(context, self._belt) for get in (plant.GetPositions, plant.GetVelocities))
        places = self._start.copy()
        places[:, _Y : _Z + 1] += travelled * self._along
        near = self._near(context, poses[:, _X:])
        on_belt = locked | (np.abs(poses - places)[:, _X:] < ASTRAY).all(axis=1)
        riding = upstream & on_belt & (places[:, _Y] < self._first) & ~near
        due = upstream & locked & ~riding
        leaving = missed & ~locked & (poses[:, _Y] > self._last) & ~near
        still = (np.abs(velocities) < STILL).all(axis=1)
        falling_asleep, waking = placed & ~locked & ~near & still, placed & locked & near

        for k in np.flatnonzero(due | waking):
            self._joints[k].Unlock(context)
        if (riding | due | leaving).any():
            poses[riding | due] = places[riding | due]
            poses[riding, _Z] += LIFT
            poses[leaving] = self._box[leaving]
            velocities[due] = 0.0
            velocities[due, _SPEED : _SPEED + 2] = speed * self._along
            q[self._q], v[self._v] = poses, velocities
            plant.SetPositions(context, q)
            plant.SetVelocities(context, v)
        for k in np.flatnonzero((riding | leaving | falling_asleep) & ~locked):
            self._joints[k].Lock(context)

    def _near(self, context: Any, p_WP: np.ndarray) -> np.ndarray:
        """Returns which of the places (n, 3) [m] are near a finger."""
        fingers = [finger.EvalPoseInWorld(context).translation() for finger in self._fingers]
        return (np.linalg.norm(p_WP[:, None] - np.array(fingers), axis=2) < NEAR).any(axis=1)
