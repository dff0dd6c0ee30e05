"""A plant with a moving object, and cameras that look at it, for the guide "Build your own diagram"."""

import numpy as np
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia
from pydrake.systems.sensors import CameraInfo, RgbdSensor


def add_carousel(builder):
    """Adds a bright box that turns about the vertical axis, at 0.2 m from it, above a dark floor. Returns the joint."""
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1 / 300)
    scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(RenderEngineVtkParams()))
    body = plant.AddRigidBody("carousel", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.05, 0.05))
    joint = plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.RegisterVisualGeometry(body, RigidTransform([0.2, 0, 0]), Box(0.05, 0.1, 0.05), "box", [0.9, 0.9, 0.8, 1])
    plant.RegisterVisualGeometry(
        plant.world_body(), RigidTransform([0, 0, -0.1]), Box(2, 2, 0.1), "floor", [0.1, 0.1, 0.12, 1]
    )
    plant.Finalize()
    return plant, scene_graph, joint


def add_camera(builder, plant, scene_graph, azimuth):
    """Adds a camera that looks at the origin from 1.2 m. Returns the sensor and its pose."""
    p_WC = np.array([np.cos(azimuth), np.sin(azimuth), 0.7])
    z = -p_WC / np.linalg.norm(p_WC)
    x = np.cross(z, [0, 0, 1]) / np.linalg.norm(np.cross(z, [0, 0, 1]))
    X_WC = RigidTransform(RotationMatrix(np.column_stack([x, np.cross(z, x), z])), p_WC)
    core = RenderCameraCore("vtk", CameraInfo(256, 256, np.pi / 6), ClippingRange(0.1, 5.0), RigidTransform())
    world = plant.GetBodyFrameIdOrThrow(plant.world_body().index())
    sensor = RgbdSensor(world, X_WC, ColorRenderCamera(core, False), DepthRenderCamera(core, DepthRange(0.1, 5.0)))
    builder.AddSystem(sensor)
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    return sensor, X_WC
