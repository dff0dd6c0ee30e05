"""Bodies on driven slides: the board that is knocked, gates, and objects that move by themselves."""

from collections.abc import Sequence

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    PdControllerGains,
    PrismaticJoint,
    RigidBody,
    SpatialInertia,
)

from drake_tracker.faults.fault import MovingBody

_FRICTION = 0.4


def add_prismatic_actuator(
    plant: MultibodyPlant,
    *,
    name: str,
    parent: Frame,
    X_PF: RigidTransform,
    body: RigidBody,
    axis: Sequence[float],
    bandwidth: float,
    travel: float,
    force: float = 500.0,
) -> None:
    """Puts a body on a prismatic joint with a position drive.

    Args:
        plant: not yet finalized.
        name: of the joint and its drive.
        parent: frame P to which the slide is fixed.
        X_PF: pose of the body at the zero of the slide.
        body: the body.
        axis: of the slide, in F.
        bandwidth: of the drive [rad/s].
        travel: largest distance from the zero to either side [m].
        force: largest force of the drive [N].
    """
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent, X_PF, body.model_instance()))
    joint = plant.AddJoint(PrismaticJoint(name, frame, body.body_frame(), axis, -travel, travel))
    actuator = plant.AddJointActuator(name, joint, force)
    mass = body.default_mass()
    actuator.set_controller_gains(PdControllerGains(p=mass * bandwidth**2, d=2.0 * mass * bandwidth))


def add_moving_body(plant: MultibodyPlant, moving: MovingBody) -> ModelInstanceIndex:
    """Adds a body, on its slide. Returns its model instance.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        moving: the body.
    """
    instance = plant.AddModelInstance(moving.name)
    box = Box(*moving.size)
    body = plant.AddRigidBody(moving.name, instance, SpatialInertia.SolidBoxWithMass(moving.mass, *moving.size))
    plant.RegisterVisualGeometry(body, RigidTransform(), box, "look", np.array(moving.colour))
    if moving.solid:
        plant.RegisterCollisionGeometry(body, RigidTransform(), box, "body", CoulombFriction(_FRICTION, _FRICTION))
    add_prismatic_actuator(
        plant,
        name=f"{moving.name}_slide",
        parent=plant.world_frame(),
        X_PF=RigidTransform(moving.X_WP),
        body=body,
        axis=moving.axis,
        bandwidth=moving.bandwidth,
        travel=moving.travel,
        force=moving.force,
    )
    return instance
