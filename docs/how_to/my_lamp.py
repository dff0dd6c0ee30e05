"""A scene with a swinging lamp, for the guide "Render beside the simulation"."""

import numpy as np
from pydrake.geometry import Box, ClippingRange, ColorRenderCamera, RenderCameraCore, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia
from pydrake.systems.sensors import CameraInfo


def add_lamp(builder):
    """Adds a lamp that swings in front of a wall. Returns the plant, the scene graph and the body of the lamp."""
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1 / 300)
    lamp = plant.AddRigidBody("lamp", SpatialInertia.SolidSphereWithMass(0.5, 0.08))
    top = plant.AddFrame(FixedOffsetFrame("top", lamp.body_frame(), RigidTransform([0, 0, 0.4])))
    joint = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), top, [1, 0, 0]))
    joint.set_default_angle(0.5)
    plant.RegisterVisualGeometry(lamp, RigidTransform(), Sphere(0.08), "bulb", [1, 0.9, 0.3, 1])
    plant.RegisterVisualGeometry(
        plant.world_body(), RigidTransform([0.6, 0, 0]), Box(0.1, 3, 3), "wall", [0.3, 0.4, 0.5, 1]
    )
    plant.Finalize()
    return plant, scene_graph, lamp


CAMERA = ColorRenderCamera(
    RenderCameraCore("", CameraInfo(160, 120, np.pi / 4), ClippingRange(0.05, 10.0), RigidTransform())
)
FORWARD = RollPitchYaw(-np.pi / 2, 0, -np.pi / 2)  # z_C along x, x_C to the right
