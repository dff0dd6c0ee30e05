"""The shape of the moving links of an arm and its hand, as cameras see it: convex pieces, placed by the joints."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Role, Shape, Sphere
from pydrake.planning import RobotDiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import add_arm
from drake_tracker.core.errors import DrakeTrackerError

TOLERANCE = 0.001
"""Depth [m] of the parts that a piece omits to save points. At the default cameras, 1 mm is a third of a pixel."""
_DIRECTIONS = 1000
"""Directions in which the extent of a piece is compared with the extent of all its points."""
_SPHERE_POINTS = 200
_CIRCLE_POINTS = 48


class ArmShape:
    """Convex pieces that together cover the moving links of an arm and its hand, for any arm.

    There is one piece for each geometry with the perception role, which is what cameras render: the convex hull of a
    mesh, or the shape itself. Points of a hull that matter by less than `TOLERANCE` are left out. Links that are fixed
    to the world are omitted: the base does not move in an image, and the table hides most of the base. The models are
    read once, on construction, into a separate plant that holds only the arm and the hand.

    One scratch Context serves all calls, and no state is kept between calls.

    Args:
        description: the arm and its hand.

    Raises DrakeTrackerError when a geometry has no hull, such as a half space.
    """

    def __init__(self, description: ArmDescription) -> None:
        builder = RobotDiagramBuilder(time_step=0.0)
        plant = builder.plant()
        parts = add_arm(plant, description=description)
        plant.Finalize()
        self._robot = builder.Build()
        self._scratch = self._robot.CreateDefaultContext()
        self._plant_scratch = self._robot.mutable_plant_context(self._scratch)
        self._arm = parts.arm
        self._fingers = [plant.GetJointByName(name, parts.gripper) for name in description.fingers]
        inspector = self._robot.scene_graph().model_inspector()
        self._pieces: list[tuple[Any, np.ndarray]] = []
        for geometry in inspector.GetAllGeometryIds(Role.kPerception):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            if plant.IsAnchored(body):
                continue
            points = _corners(inspector.GetShape(geometry), inspector.GetName(geometry))
            p_BQ = inspector.GetPoseInFrame(geometry) @ _few(points).T
            self._pieces.append((body, p_BQ.T))

    def pieces(self, q: np.ndarray, jaw_width: float = 0.0) -> list[np.ndarray]:
        """Returns the corners of each convex piece, p_WQ of shape (n, 3) [m].

        Args:
            q: joint positions of the arm, shape (n,) [rad].
            jaw_width: opening of the jaws [m], half of which is the position of each finger: ``JawState.width``.
                Without effect for a hand without fingers.
        """
        context = self._plant_scratch
        plant = self._robot.plant()
        plant.SetPositions(context, self._arm, q)
        for finger in self._fingers:
            finger.set_translation(context, 0.5 * jaw_width)
        placed = []
        for body, p_BQ in self._pieces:
            X_WB = plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34()
            placed.append(p_BQ @ X_WB[:, :3].T + X_WB[:, 3])
        return placed


def _corners(shape: Shape, name: str) -> np.ndarray:
    """Returns points (n, 3) [m] whose convex hull covers a shape up to a millimetre, in the frame of the shape."""
    for kind, corners in _CORNERS.items():
        if isinstance(shape, kind):
            return corners(shape)
    raise DrakeTrackerError(f"the visual geometry {name} of the arm is a {type(shape).__name__}, which has no hull")


def _hull(shape: Mesh | Convex) -> np.ndarray:
    hull = shape.GetConvexHull()
    return np.array([hull.vertex(k) for k in range(hull.num_vertices())])


def _box(shape: Box) -> np.ndarray:
    return 0.5 * shape.size() * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])


def _cylinder(shape: Cylinder) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS, endpoint=False)
    circle = shape.radius() * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_CIRCLE_POINTS)])
    half = [0.0, 0.0, 0.5 * shape.length()]
    return np.vstack([circle - half, circle + half])


def _capsule(shape: Capsule) -> np.ndarray:
    ball = shape.radius() * _directions(_SPHERE_POINTS)
    half = [0.0, 0.0, 0.5 * shape.length()]
    return np.vstack([ball - half, ball + half])


_CORNERS: dict[type, Callable[[Any], np.ndarray]] = {
    Mesh: _hull,
    Convex: _hull,
    Box: _box,
    Cylinder: _cylinder,
    Capsule: _capsule,
    Sphere: lambda shape: shape.radius() * _directions(_SPHERE_POINTS),
    Ellipsoid: lambda shape: np.array([shape.a(), shape.b(), shape.c()]) * _directions(_SPHERE_POINTS),
}


def _few(points: np.ndarray) -> np.ndarray:
    """Returns those of the points (n, 3) [m] that suffice for their convex hull up to `TOLERANCE`.

    The hull of the chosen points grows by the farthest point in the direction in which it is most too short.
    """
    extents = _directions(_DIRECTIONS) @ points.T
    wanted = extents.max(axis=1)
    chosen = [int(extents[0].argmax())]
    reached = extents[:, chosen[0]]
    while (short := wanted - reached).max() > TOLERANCE:
        chosen.append(int(extents[short.argmax()].argmax()))
        reached = np.maximum(reached, extents[:, chosen[-1]])
    return points[chosen]


def _directions(count: int) -> np.ndarray:
    """Returns unit vectors (count, 3), spread evenly over the sphere on a spiral."""
    number = np.arange(count)
    z = 1.0 - (2.0 * number + 1.0) / count
    angle = number * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - z * z)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
