"""Drake Systems of the further moving objects: their drives, and their true states for judges and logs."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, RigidBody
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem, OutputPort

from drake_tracker.world.disturbance_system import add_disturbance
from drake_tracker.world.scene_object import Ride, SceneObject
from drake_tracker.world.train.rail_system import RailSystem

STATE_SIZE = 13
"""Numbers of the state of one object."""


class ObjectStatesSystem(LeafSystem):
    """States of bodies in the form of free bodies.

    .. pydrake_system::

        name: ObjectStatesSystem
        input_ports:
        - body_poses
        - body_spatial_velocities
        output_ports:
        - states

    Inputs: the ports of the same names of the plant. ``states``: for each body 13 numbers in W: quaternion w, x, y, z,
    position [m], angular velocity [rad/s], velocity [m/s]. There is no state.

    Args:
        bodies: of the plant.
    """

    def __init__(self, bodies: Sequence[BodyIndex]) -> None:
        super().__init__()
        self._bodies = [int(body) for body in bodies]
        self._poses = self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform()]))
        self._velocities = self.DeclareAbstractInputPort(
            "body_spatial_velocities", AbstractValue.Make([SpatialVelocity()])
        )
        prerequisites = {self._poses.ticket(), self._velocities.ticket()}
        size = STATE_SIZE * len(self._bodies)
        self.DeclareVectorOutputPort("states", size, self._calc, prerequisites_of_calc=prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        poses, velocities = self._poses.Eval(context), self._velocities.Eval(context)
        pieces = []
        for body in self._bodies:
            X_WB, V_WB = poses[body], velocities[body]
            pieces += [X_WB.rotation().ToQuaternion().wxyz(), X_WB.translation()]
            pieces += [V_WB.rotational(), V_WB.translational()]
        output.SetFromVector(np.concatenate(pieces))


def add_object_states(
    builder: DiagramBuilder, *, plant: MultibodyPlant, bodies: Sequence[RigidBody], name: str = "object_states"
) -> ObjectStatesSystem:
    """Adds an `ObjectStatesSystem` and connects it to a plant.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        bodies: of the plant, at least one.
        name: of the System.
    """
    states = builder.AddNamedSystem(name, ObjectStatesSystem([body.index() for body in bodies]))
    builder.Connect(plant.get_body_poses_output_port(), states.GetInputPort("body_poses"))
    builder.Connect(plant.get_body_spatial_velocities_output_port(), states.GetInputPort("body_spatial_velocities"))
    return states


def add_object_motion(builder: DiagramBuilder, *, plant: MultibodyPlant, moving: SceneObject) -> OutputPort | None:
    """Adds the System that moves an object: a `RailSystem` for a ride on rails, or else a `DisturbanceSystem` for its
    slide.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        moving: the object, whose body the plant has.

    Returns the spatial forces on the object, for the plant's port ``applied_spatial_force``; None for a slide.
    """
    instance = plant.GetModelInstanceByName(moving.name)
    ride = moving.motion
    if not isinstance(ride, Ride):
        add_disturbance(builder, plant=plant, slide=instance, name=moving.name, path=ride)
        return None
    (body,) = plant.GetBodyIndices(instance)
    height = plant.GetDefaultFloatingBaseBodyPose(plant.get_body(body)).translation()[2]
    rail = RailSystem(ride, body, height)
    builder.AddNamedSystem(f"{moving.name}_rail", rail)
    builder.Connect(plant.get_state_output_port(instance), rail.GetInputPort("train_state"))
    return rail.GetOutputPort("spatial_forces")
