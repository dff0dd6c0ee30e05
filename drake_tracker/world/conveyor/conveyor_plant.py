"""The laboratory of the conveyor: arm, gripper, table, belt, trays and parts in one MultibodyPlant."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box, GeometryInstance, IllustrationProperties, PerceptionProperties, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import add_arm, couple_fingers, set_servo_gains
from drake_tracker.core.models_path import models_path
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.fault import MovingBody
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import BeltMotion
from drake_tracker.world.conveyor.conveyor_config import SIDES, BeltConfig, TrayConfig, cell_centres
from drake_tracker.world.conveyor.part_model import FRICTION, LYING, add_part, lying_height, rest_height
from drake_tracker.world.painted_mesh import memory_mesh
from drake_tracker.world.prismatic_actuator import add_moving_body, add_prismatic_actuator
from drake_tracker.world.train.plant import TABLE_TOP, add_ground, add_plant, add_table
from drake_tracker.world.visual_mesh import add_visual_mesh, merge, obj_text, prism, rectangle

SLAB_THICKNESS = 0.02
"""Thickness of the belt [m]."""
TABLE_BELOW = 0.03
"""Distance of the table's top below the upper face of the belt, which is also the thickness of a tray's floor [m]."""
TABLE_EDGE = TABLE_TOP[0][1], TABLE_TOP[1][1]
"""Lowest and highest y of the table [m]."""
BEYOND = 0.4
"""Length of the belt beyond its end and beyond the last part [m]."""
_SLAB_MASS, _BANDWIDTH, _FORCE = 10.0, 200.0, 2000.0
_FLOOR = (8.0, 8.0, 0.1)
SUNK = 0.001
"""Depth of the slab's visual geometry below the textured face, so that no two faces coincide [m]."""
BELT_COLOUR = (0.10, 0.11, 0.12, 1.0)
TRAY_COLOUR = (0.24, 0.27, 0.31, 1.0)
WALL_COLOUR = (0.45, 0.48, 0.52, 1.0)
TILE = 0.30
"""Length along the belt of one tile of the texture [m]."""
_TEXTURE = "rubber.png"
_MATERIAL = f"newmtl rubber\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nmap_Kd {_TEXTURE}\n"


@dataclass(frozen=True)
class ConveyorLaboratory:
    """A plant with an arm, a gripper, a table, a belt, two trays and parts.

    Attributes:
        plant: finalized.
        scene_graph: with which the plant is registered.
        arm: model instance.
        gripper: model instance.
        fingers: bodies of the gripper's fingers, left and right.
        table: model instance.
        belt: model instance with one driven joint.
        belt_body: its one body.
        trays: model instance of both trays.
        parts: one free body for each arrival.
        floor: z_W of the floor [m].
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    arm: ModelInstanceIndex
    gripper: ModelInstanceIndex
    fingers: tuple[RigidBody, ...]
    table: ModelInstanceIndex
    belt: ModelInstanceIndex
    belt_body: RigidBody
    trays: ModelInstanceIndex
    parts: tuple[RigidBody, ...]
    floor: float = 0.0


def add_conveyor_laboratory(
    builder: DiagramBuilder,
    *,
    description: ArmDescription,
    belt: BeltConfig = BeltConfig(),
    tray: TrayConfig = TrayConfig(),
    motion: BeltMotion,
    arrivals: Sequence[Arrival],
    duration: float,
    time_step: float = TIME_STEP,
    grip_force: float = 25.0,
    bodies: Sequence[MovingBody] = (),
    decorate: Callable[[MultibodyPlant], object] | None = None,
) -> ConveyorLaboratory:
    """Adds the plant of the conveyor's laboratory and its scene graph to a diagram.

    The belt is one slab, long enough for the whole run. All parts lie on the slab from the beginning; parts that arrive
    later lie farther upstream.

    Args:
        builder: of the diagram.
        description: an arm with a gripper.
        belt: where the belt lies.
        tray: the trays.
        motion: of the belt.
        arrivals: the parts.
        duration: of the run [s].
        time_step: of the plant [s].
        grip_force: largest force on each pad [N].
        bodies: moving bodies of faults.
        decorate: called with the plant before it is finalized, to add visual geometry.
    """
    plant, scene_graph = add_plant(builder, time_step=time_step)
    parts = add_arm(plant, description=description)
    couple_fingers(plant, parts.gripper, description, grip_force)
    set_servo_gains(plant, parts.arm, description.servo_inertia, description.servo_bandwidth)
    table = add_table(plant, height=belt.height - table_below(belt))
    travel = motion.distance(duration)
    floor = floor_top(belt, travel)
    add_ground(plant, table=table, size=_FLOOR, material=CoulombFriction(FRICTION, FRICTION), top=floor)
    belt_body = add_belt(plant, belt=belt, travel=travel)
    trays = add_trays(plant, tray=tray, height=belt.height, thickness=table_below(belt))
    part_bodies = tuple(
        add_part(plant, kind=arrival.kind, colour=arrival.colour, name=f"part_{number}", lies=arrival.lies)
        for number, arrival in enumerate(arrivals, start=1)
    )
    for moving in bodies:
        add_moving_body(plant, moving)
    if decorate is not None:
        decorate(plant)
    plant.Finalize()
    for body, arrival in zip(part_bodies, arrivals):
        plant.SetDefaultFloatingBaseBodyPose(body, start_pose(arrival, belt, motion))
    return ConveyorLaboratory(
        plant=plant,
        scene_graph=scene_graph,
        arm=parts.arm,
        gripper=parts.gripper,
        fingers=tuple(plant.GetJointByName(name, parts.gripper).child_body() for name in description.fingers),
        table=table,
        belt=belt_body.model_instance(),
        belt_body=belt_body,
        trays=trays,
        parts=part_bodies,
        floor=floor,
    )


def start_pose(arrival: Arrival, belt: BeltConfig, motion: BeltMotion) -> RigidTransform:
    """Returns the pose in W of a part at time 0.

    Args:
        arrival: of the part.
        belt: where the belt lies.
        motion: of the belt.
    """
    y = belt.entry - motion.distance(arrival.time)
    R_WP, height = RotationMatrix.MakeZRotation(arrival.yaw), rest_height(arrival.kind)
    if arrival.lies:
        R_WP, height = R_WP @ LYING[arrival.kind], lying_height(arrival.kind)
    X_WP = RigidTransform(R_WP, [arrival.x, y, belt.height + height])
    return X_WP if belt.incline_deg == 0.0 else RigidTransform(belt.frame.X_WB) @ X_WP


def floor_top(belt: BeltConfig, travel: float) -> float:
    """Returns z_W of the floor [m]: an inclined belt comes from below, and the floor lies under the whole belt."""
    lowest = belt.height + (belt.entry - travel - BEYOND) * math.sin(belt.frame.angle) - SLAB_THICKNESS
    return min(0.0, lowest - TABLE_BELOW)


def table_below(belt: BeltConfig) -> float:
    """Returns the distance of the table's top below the face of the belt at y = 0 [m]: an inclined belt needs room."""
    reach = max(-TABLE_EDGE[0], TABLE_EDGE[1])
    return TABLE_BELOW + reach * math.sin(abs(belt.frame.angle))


def add_belt(plant: MultibodyPlant, *, belt: BeltConfig, travel: float) -> RigidBody:
    """Adds the belt, a slab on a driven slide along y_W, to a plant that is not yet finalized.

    Args:
        plant: registered with a SceneGraph.
        belt: where it lies.
        travel: distance that it travels during the run [m].

    Returns its body, whose frame has its origin in W's plane y = 0, in the middle of the upper face, at the start.
    """
    instance = plant.AddModelInstance("belt")
    low, high = belt.entry - travel - BEYOND, belt.end + BEYOND
    size = [belt.width, high - low, SLAB_THICKNESS]
    body = plant.AddRigidBody("belt", instance, SpatialInertia.SolidBoxWithMass(_SLAB_MASS, *size))
    X_BG = RigidTransform([0.0, 0.5 * (low + high), -0.5 * SLAB_THICKNESS])
    plant.RegisterCollisionGeometry(body, X_BG, Box(*size), "slab", CoulombFriction(FRICTION, FRICTION))
    # The box shows the sides, below the textured face.
    X_BSides = RigidTransform(X_BG.translation() - [0.0, 0.0, SUNK])
    plant.RegisterVisualGeometry(body, X_BSides, Box(*size), "sides", np.array(BELT_COLOUR))
    add_belt_visual(plant, body=body, width=belt.width, low=low, high=high)
    add_prismatic_actuator(
        plant,
        name="belt",
        parent=plant.world_frame(),
        X_PF=RigidTransform(belt.frame.X_WB) @ RigidTransform([belt.middle, 0.0, belt.height]),
        body=body,
        axis=(0.0, 1.0, 0.0),
        bandwidth=_BANDWIDTH,
        travel=travel + 1.0,
        force=_FORCE,
    )
    return body


def add_trays(
    plant: MultibodyPlant, *, tray: TrayConfig, height: float, thickness: float = TABLE_BELOW
) -> ModelInstanceIndex:
    """Adds both trays, welded to the world, to a plant that is not yet finalized. Returns their model instance.

    Args:
        plant: registered with a SceneGraph.
        tray: their dimensions and places.
        height: of the floors of the cells in W [m].
        thickness: of the floors, down to the table [m].
    """
    instance = plant.AddModelInstance("trays")
    friction = CoulombFriction(FRICTION, FRICTION)
    wall = tray.pitch - tray.cell
    centres = cell_centres(tray).reshape(len(SIDES), -1, 2)
    for number, cells in enumerate(centres, start=1):
        name = f"tray_{number}"
        body = plant.AddRigidBody(name, instance, SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.4, thickness))
        middle = 0.5 * (cells.min(axis=0) + cells.max(axis=0))
        plant.WeldFrames(plant.world_frame(), body.body_frame(), RigidTransform([*middle, height]))
        size = np.array([tray.columns, tray.rows]) * tray.pitch + wall
        places, extents = [np.array([0.0, 0.0, -0.5 * thickness])], [np.array([*size, thickness])]
        for axis, count in enumerate((tray.columns, tray.rows)):
            for k in range(count + 1):
                place, extent = np.array([0.0, 0.0, 0.5 * tray.wall_height]), np.array([*size, tray.wall_height])
                place[axis], extent[axis] = (k - 0.5 * count) * tray.pitch, wall
                places.append(place)
                extents.append(extent)
        for part, (place, extent) in enumerate(zip(places, extents)):
            X_BG = RigidTransform(place)
            plant.RegisterCollisionGeometry(body, X_BG, Box(*extent), f"solid_{part}", friction)
        walls = merge(
            [prism(rectangle(place[:2], *extent[:2]), 0.0, tray.wall_height) for place, extent in zip(places, extents)][
                1:
            ]
        )
        for look, mesh, colour in (
            ("floor", prism(rectangle((0.0, 0.0), *size), -thickness, 0.0), TRAY_COLOUR),
            ("walls", walls, WALL_COLOUR),
        ):
            add_visual_mesh(plant, body=body, X_BG=RigidTransform(), mesh=mesh, name=look, colour=colour)
    return instance


def add_belt_visual(plant: MultibodyPlant, *, body: RigidBody, width: float, low: float, high: float) -> None:
    """Adds the appearance of the upper face of a belt, the plane z = 0 of its body, to a plant.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        body: of the belt.
        width: of the belt, along x [m].
        low: y at which the belt begins [m].
        high: y up to which it reaches at least [m].
    """
    image = (models_path() / "belt" / _TEXTURE).read_bytes()
    files = {"belt.mtl": _MATERIAL.encode(), _TEXTURE: image}
    mesh = memory_mesh("belt.obj", belt_text(width, low, high).encode(), files, np.ones(3))
    look = GeometryInstance(RigidTransform(), mesh, "look")
    look.set_illustration_properties(IllustrationProperties())
    look.set_perception_properties(PerceptionProperties())
    plant.RegisterVisualGeometry(body, look)


def belt_text(width: float, low: float, high: float) -> str:
    """Returns the OBJ text of the upper face of a belt, a row of whole tiles; arguments as for `add_belt_visual`."""
    count = math.ceil((high - low) / TILE - 1e-9)
    y = low + TILE * np.arange(count + 1)
    left, right = (np.column_stack([np.full_like(y, x), y, np.zeros_like(y)]) for x in (-0.5 * width, 0.5 * width))
    vertices = np.stack([left, right], axis=1).reshape(-1, 3)
    # Corners of the texture: across the belt v, along it u.
    texture = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])
    faces = [[(2 * k, 0, 0), (2 * k + 1, 1, 0), (2 * k + 3, 2, 0), (2 * k + 2, 3, 0)] for k in range(count)]
    return obj_text(
        vertices, np.array([[0.0, 0.0, 1.0]]), faces, texture=texture, header=["mtllib belt.mtl", "usemtl rubber"]
    )
