"""The laboratory of the train: arm, gripper, table and train in one MultibodyPlant."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box, ProximityProperties, Role, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import add_arm, couple_fingers, models_parser, set_servo_gains
from drake_tracker.core.colour import rgb
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.world.config import TrainConfig
from drake_tracker.world.painted_mesh import paint_visual, stain
from drake_tracker.world.scene_object import SceneObject
from drake_tracker.world.train.hill import TRAIN_HEIGHT, track_frame
from drake_tracker.world.train.tracks import Track
from drake_tracker.world.train.train_model import add_train

TABLE_TOP = ((0.21, -0.50), (0.91, 0.50))
"""Lowest and highest corner (x, y) in W of the table's top, as in its model [m]."""
WHEELS, CUBE_WHEELS = (0.045, 0.015), (0.015, 0.015)
"""Distances of the wheels of a train and of a cube from the centre, along and across, as in the models [m]."""
TABLE_MODEL_HEIGHT = 0.45
"""Height of the table model's top above its own origin [m]."""
TABLE_TOP_VISUAL = "table::top"
"""Name of the visual geometry of the table's top."""
TABLE_FRAME = "table::frame"
"""Name of the geometry under the table's top."""


@dataclass(frozen=True)
class Laboratory:
    """A plant with an arm, a gripper, a table and a train.

    Attributes:
        plant: finalized.
        scene_graph: with which the plant is registered.
        arm: model instance.
        gripper: model instance.
        fingers: bodies of the gripper's fingers, left and right.
        table: model instance.
        train: model instance.
        train_body: its one body, which is free.
        object_bodies: one body of each further object.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    arm: ModelInstanceIndex
    gripper: ModelInstanceIndex
    fingers: tuple[RigidBody, ...]
    table: ModelInstanceIndex
    train: ModelInstanceIndex
    train_body: RigidBody
    object_bodies: tuple[RigidBody, ...] = ()


def add_laboratory(
    builder: DiagramBuilder,
    *,
    description: ArmDescription,
    body: str = "plain",
    scale: float = 1.0,
    colour: str = "",
    table_height: float = 0.45,
    table_colour: str = "",
    time_step: float = TIME_STEP,
    grip_force: float = 25.0,
    objects: Sequence[SceneObject] = (),
    decorate: Callable[[MultibodyPlant], None] | None = None,
) -> Laboratory:
    """Adds the plant of the train's laboratory and its scene graph to a diagram.

    Args:
        builder: of the diagram.
        description: the arm and its gripper.
        body: which of the train models.
        scale: length of the train relative to its model.
        colour: main colour of the train, "#rrggbb"; empty: the colour of the model.
        table_height: height of the table's top in W [m].
        table_colour: mean colour of the table's top, "#rrggbb"; empty: the colour of the model.
        time_step: of the plant [s].
        grip_force: largest force on each pad [N].
        objects: further objects that move by themselves.
        decorate: called with the plant before it is finalized, to add visuals.
    """
    plant, scene_graph = add_plant(builder, time_step=time_step)
    parts = add_arm(plant, description=description)
    couple_fingers(plant, parts.gripper, description, grip_force)
    set_servo_gains(plant, parts.arm, description.servo_inertia, description.servo_bandwidth)
    table = add_table(plant, height=table_height)
    if table_colour:
        top = plant.GetBodyByName("table", table)
        paint_visual(plant, scene_graph, body=top, name=TABLE_TOP_VISUAL, paint=stain(rgb(table_colour)))
    train = add_train(plant, body=body, scale=scale, colour=colour, scene_graph=scene_graph)
    if decorate is not None:
        decorate(plant)
    object_bodies = tuple(each.add_body(plant, scene_graph) for each in objects)
    plant.Finalize()
    return Laboratory(
        plant=plant,
        scene_graph=scene_graph,
        arm=parts.arm,
        gripper=parts.gripper,
        fingers=tuple(plant.GetJointByName(name, parts.gripper).child_body() for name in description.fingers),
        table=table,
        train=train,
        train_body=plant.GetBodyByName("train", train),
        object_bodies=object_bodies,
    )


def add_plant(builder: DiagramBuilder, *, time_step: float) -> tuple[MultibodyPlant, SceneGraph]:
    """Adds an empty plant with the contact model of all laboratories, and its scene graph.

    Args:
        builder: of the diagram.
        time_step: of the plant [s].
    """
    config = MultibodyPlantConfig(time_step=time_step, contact_model="point", discrete_contact_approximation="lagged")
    plant, scene_graph = AddMultibodyPlant(config, builder)
    return plant, scene_graph


def add_table(plant: MultibodyPlant, *, height: float, x: float = 0.0) -> ModelInstanceIndex:
    """Adds the table, welded to the world.

    Args:
        plant: not yet finalized.
        height: of the table's top in W [m].
        x: distance by which the table is moved along x_W, away from the arm [m].
    """
    (table,) = models_parser(plant).AddModelsFromUrl("package://drake_tracker_models/table/table.sdf")
    X_WTable = RigidTransform([x, 0.0, height - TABLE_MODEL_HEIGHT])
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("table", table), X_WTable)
    return table


def add_ground(
    plant: MultibodyPlant,
    *,
    table: ModelInstanceIndex,
    size: Sequence[float],
    material: CoulombFriction | ProximityProperties,
    top: float = 0.0,
) -> None:
    """Adds the floor as a body that is welded to the world.

    Drake 1.51 crashes if geometry of the world body touches a body while the joint of any body is locked (issue 24773).

    Args:
        plant: not yet finalized.
        table: model instance to which the body of the floor belongs.
        size: along x, y and z [m].
        material: friction, or all properties of contact.
        top: z_W of its upper face [m].
    """
    floor = plant.AddRigidBody("floor", table, SpatialInertia.Zero())
    plant.WeldFrames(plant.world_frame(), floor.body_frame())
    plant.RegisterCollisionGeometry(
        floor, RigidTransform([0.0, 0.0, top - 0.5 * size[2]]), Box(*size), "floor", material
    )


def wheels(train: TrainConfig) -> tuple[float, float]:
    """Returns the distances of the wheels of a train from its centre, along and across [m]."""
    return CUBE_WHEELS if train.body == "cube" else (train.scale * WHEELS[0], WHEELS[1])


def hide_table_frame(laboratory: Laboratory) -> None:
    """Makes the frame under the table invisible to cameras.

    A camera never sees it through a window around a volume above the table: behind such a volume lies the top of the
    table, or the scene beyond its far edge. Elsewhere in the rectangle of the window some pixels show it.

    Args:
        laboratory: with a finalized plant and no renderer yet.
    """
    scene_graph = laboratory.scene_graph
    inspector, source = scene_graph.model_inspector(), laboratory.plant.get_source_id()
    for geometry in inspector.GetAllGeometryIds(Role.kPerception):
        if inspector.GetName(geometry) == TABLE_FRAME:
            scene_graph.RemoveRole(source, geometry, Role.kPerception)


def table_box(*, height: float, x: float = 0.0) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Returns the lowest and the highest corner in W of the space that the table takes, down to the floor [m].

    Args:
        height: of the table's top in W [m].
        x: distance by which the table is moved along x_W, away from the arm [m].
    """
    (x_low, y_low), (x_high, y_high) = TABLE_TOP
    return (x_low + x, y_low, 0.0), (x_high + x, y_high, height)


def place_train(laboratory: Laboratory, *, track: Track, s: float, table_height: float, turns: bool = True) -> None:
    """Puts the train at rest on the track, in every default Context of the plant.

    Args:
        laboratory: of the train.
        track: the track.
        s: arc length at which the train stands [m].
        table_height: height of the table's top in W [m].
        turns: whether it stands along the track; otherwise along x_W.
    """
    X_WO = train_pose(track, s, table_height, turns)
    laboratory.plant.SetDefaultFloatingBaseBodyPose(laboratory.train_body, X_WO)


def train_pose(track: Track, s: float, table_height: float, turns: bool = True) -> RigidTransform:
    """Returns the pose in W of a train that stands on a track.

    Args:
        track: the track.
        s: arc length at which the train stands [m].
        table_height: height of the table's top in W [m].
        turns: whether it stands along the track; otherwise along x_W.
    """
    x, y, heading = track.pose(s)
    if track.heights is None:
        level = RotationMatrix.MakeZRotation(heading if turns else 0.0)
        return RigidTransform(level, [x, y, table_height + TRAIN_HEIGHT])
    height, slope, lean = map(float, track.profile(s))
    along, left, normal = track_frame(math.cos(heading), math.sin(heading), slope, lean)
    if not turns:
        left = np.cross(normal, [1.0, 0.0, 0.0])
        left = left / np.linalg.norm(left)
        along = np.cross(left, normal)
    R_WO = RotationMatrix(np.column_stack([along, left, normal]))
    return RigidTransform(R_WO, np.array([x, y, table_height + height]) + TRAIN_HEIGHT * normal)
