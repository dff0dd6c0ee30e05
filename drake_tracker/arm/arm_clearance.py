"""Distances between the links of the arm, and from the arm to fixed obstacles, such as the table."""

from collections.abc import Sequence
from enum import Enum
from functools import lru_cache

import numpy as np
from pydrake.geometry import Box, CollisionFilterDeclaration, GeometryId, GeometrySet
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.planning import RobotDiagram, RobotDiagramBuilder

from drake_tracker.arm.arm_model import add_held_arm
from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import is_packaged

MARGIN = 0.005
"""Distance [m] that links keep from each other and from obstacles. In a normal grasp of the train, the
pads of the hand stay more than 20 mm above the table."""
_ALREADY_NEAR = 2.0
"""Pairs that are nearer at the start than this many margins are not watched."""


class Nearness(Enum):
    """The body that a link is too near to."""

    OBSTACLE = "obstacle"
    LINK = "link"


class ArmClearance:
    """Distances between the arm's links, and from them to obstacles, by the collision geometry of the models.

    Links that a joint connects are not watched, nor are pairs that are near each other already at ``q_start`` of the
    description: they stay so by construction. The fingers are in the middle of their travel.

    One scratch Context serves all calls, and no state is kept between calls.

    Args:
        description: the arm and its hand.
        obstacles: boxes in W that no link may enter, as pairs of their lowest and highest corner (x, y, z) [m].
        margin: distance to keep [m].
    """

    def __init__(
        self,
        description: ArmDescription,
        obstacles: Sequence[tuple[Sequence[float], Sequence[float]]] = (),
        margin: float = MARGIN,
    ) -> None:
        self._margin = margin
        corners = tuple(tuple(tuple(map(float, corner)) for corner in pair) for pair in obstacles)
        make = _robot_between if is_packaged(description) else _robot_between.__wrapped__
        self._robot, self._arm, self._obstacles = make(description, corners)
        self._scratch = self._robot.CreateDefaultContext()
        self._plant_scratch = self._robot.mutable_plant_context(self._scratch)
        self._scene_scratch = self._robot.mutable_scene_graph_context(self._scratch)
        filters = self._robot.scene_graph().collision_filter_manager(self._scene_scratch)
        for pair in self._pairs(np.array(description.q_start), _ALREADY_NEAR * margin):
            filters.Apply(CollisionFilterDeclaration().ExcludeWithin(GeometrySet([pair.id_A, pair.id_B])))

    def nearness(self, q: np.ndarray) -> Nearness | None:
        """Returns the body to which a link is nearer than the margin at joint positions q, shape (n,) [rad]; None:
        nothing."""
        pairs = self._pairs(q, self._margin)
        if not pairs:
            return None
        own = all(pair.id_A not in self._obstacles and pair.id_B not in self._obstacles for pair in pairs)
        return Nearness.LINK if own else Nearness.OBSTACLE

    def distance(self, q: np.ndarray, up_to: float) -> float:
        """Returns the least distance [m] between two watched bodies; ``up_to`` if it is larger.

        Args:
            q: joint positions, shape (n,) [rad].
            up_to: largest distance of interest [m].
        """
        return min((pair.distance for pair in self._pairs(q, up_to)), default=up_to)

    def _pairs(self, q: np.ndarray, distance: float) -> list:
        self._robot.plant().SetPositions(self._plant_scratch, self._arm, q)
        query = self._robot.scene_graph().get_query_output_port().Eval(self._scene_scratch)
        return query.ComputeSignedDistancePairwiseClosestPoints(distance)


@lru_cache(maxsize=8)
def _robot_between(
    description: ArmDescription, obstacles: tuple[tuple[tuple[float, ...], ...], ...]
) -> tuple[RobotDiagram, ModelInstanceIndex, frozenset[GeometryId]]:
    """Returns (an arm with its held hand between boxes, the arm's model instance, the geometries of the boxes)."""
    builder = RobotDiagramBuilder(time_step=0.0)
    plant = builder.plant()
    parts = add_held_arm(plant, description)
    fixed = []
    for number, corners in enumerate(obstacles):
        low, high = map(np.array, corners)
        shape, X_WB = Box(high - low), RigidTransform(0.5 * (low + high))
        friction = CoulombFriction(0.0, 0.0)
        fixed.append(plant.RegisterCollisionGeometry(plant.world_body(), X_WB, shape, f"obstacle_{number}", friction))
    plant.Finalize()
    return builder.Build(), parts.arm, frozenset(fixed)
