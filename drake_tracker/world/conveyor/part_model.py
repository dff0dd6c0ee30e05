"""The parts as free bodies of a plant, made by code from their dimensions.

A part stands on small spheres at the corners of its base. A solid that lies on a plane would have one point of contact
with it, about which it tips; four points hold it still.
"""

import numpy as np
from pydrake.geometry import Box, Cylinder, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody, SpatialInertia

from drake_tracker.core.colour import rgb
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind, part_outline, solids
from drake_tracker.world.visual_mesh import add_visual_mesh, disc, merge, prism, rectangle

FRICTION = 0.8
DENSITY = 2200.0
"""Density of the parts [kg/m^3], so that they weigh 60 to 100 g."""
FOOT_RADIUS = 0.003
"""Radius of the spheres on which a part stands [m]."""
FOOT_REACH = 0.0015
"""Distance by which the spheres reach below the solid that the jaws hold [m]."""
_DISC_FEET = 4
LYING = {
    PartKind.BOX: RotationMatrix.MakeYRotation(-0.5 * np.pi),
    PartKind.ELL: RotationMatrix.MakeXRotation(0.5 * np.pi),
}
"""{kind: rotation that tips a part onto a side}: a box onto its end, an ell onto the outer edge of its long leg. A disc
would roll away."""


def rest_height(kind: PartKind) -> float:
    """Returns the height of the origin of P above the plane on which a part stands [m]."""
    return 0.5 * PART_SHAPES[kind].height


def lying_height(kind: PartKind) -> float:
    """Returns the height of the origin of P above the plane on which a part of `LYING` lies on a side [m]."""
    shape = PART_SHAPES[kind]
    return 0.5 * (shape.length if kind is PartKind.BOX else shape.width) + FOOT_REACH


def part_inertia(kind: PartKind) -> SpatialInertia:
    """Returns the inertia of a part about the origin of P."""
    shape = PART_SHAPES[kind]
    if kind is PartKind.DISC:
        return SpatialInertia.SolidCylinderWithDensity(DENSITY, 0.5 * shape.width, shape.height, [0.0, 0.0, 1.0])
    inertia = SpatialInertia.Zero()
    for (x, y), (along, across) in solids(kind):
        box = SpatialInertia.SolidBoxWithDensity(DENSITY, along, across, shape.height)
        inertia += box.Shift([-x, -y, 0.0])
    return inertia


def feet(kind: PartKind) -> np.ndarray:
    """Returns the places (x, y) in P of the spheres on which a part stands, shape (n, 2) [m]."""
    shape = PART_SHAPES[kind]
    if kind is PartKind.DISC:
        return disc((0.0, 0.0), 0.5 * shape.width - FOOT_RADIUS, _DISC_FEET)
    corners = [
        (x + i * (0.5 * along - FOOT_RADIUS), y + j * (0.5 * across - FOOT_RADIUS))
        for (x, y), (along, across) in solids(kind)
        for i in (-1, 1)
        for j in (-1, 1)
    ]
    if kind is PartKind.BOX:
        return np.array(corners)
    # Of the short leg, only the corners at its tip.
    return np.array([corners[0], corners[2], corners[1], corners[5], corners[7]])


def side_feet(kind: PartKind) -> np.ndarray:
    """Returns the centres in P of the spheres on which a part of `LYING` lies on a side, shape (4, 3) [m]."""
    shape = PART_SHAPES[kind]
    depth = lying_height(kind) - FOOT_RADIUS
    high = 0.5 * shape.height - FOOT_RADIUS
    if kind is PartKind.BOX:
        wide = 0.5 * shape.width - FOOT_RADIUS
        return np.array([[-depth, j * wide, k * high] for j in (-1, 1) for k in (-1, 1)])
    long = 0.5 * shape.length - FOOT_RADIUS
    return np.array([[shape.middle + i * long, -depth, k * high] for i in (-1, 1) for k in (-1, 1)])


def add_part(plant: MultibodyPlant, *, kind: PartKind, colour: str, name: str, lies: bool = False) -> RigidBody:
    """Adds a part, one free body whose frame is P, to a plant.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        kind: of the part.
        colour: as "#rrggbb".
        name: of the model instance and its body.
        lies: whether it has feet to lie on a side as well, see `LYING`.
    """
    shape = PART_SHAPES[kind]
    instance = plant.AddModelInstance(name)
    body = plant.AddRigidBody(name, instance, part_inertia(kind))
    friction = CoulombFriction(FRICTION, FRICTION)
    for number, (x, y) in enumerate(feet(kind)):
        X_PS = RigidTransform([x, y, FOOT_RADIUS - 0.5 * shape.height])
        plant.RegisterCollisionGeometry(body, X_PS, Sphere(FOOT_RADIUS), f"foot_{number}", friction)
    for number, p_PS in enumerate(side_feet(kind) if lies else ()):
        X_PS = RigidTransform(p_PS)
        plant.RegisterCollisionGeometry(body, X_PS, Sphere(FOOT_RADIUS), f"side_foot_{number}", friction)
    height = shape.height - FOOT_REACH
    for number, ((x, y), (along, across)) in enumerate(solids(kind)):
        X_PG = RigidTransform([x, y, 0.5 * FOOT_REACH])
        solid: Shape = Box(along, across, height)
        if kind is PartKind.DISC:
            solid = Cylinder(0.5 * shape.width, height)
        plant.RegisterCollisionGeometry(body, X_PG, solid, f"solid_{number}", friction)
    bottom, top = -0.5 * shape.height, 0.5 * shape.height
    if kind is PartKind.ELL:
        mesh = merge([prism(rectangle(centre, *size), bottom, top) for centre, size in solids(kind)])
    else:
        mesh = prism(part_outline(kind), bottom, top)
    add_visual_mesh(
        plant, body=body, X_BG=RigidTransform(), mesh=mesh, name="look", colour=(*rgb(colour).tolist(), 1.0)
    )
    return body
