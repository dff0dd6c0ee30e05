"""A user's diagram: cameras on the user's own plant, then the package's vision and estimation."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from drake_tracker.cameras import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import TrackPoint
from drake_tracker.estimation import add_estimator, make_estimator
from drake_tracker.vision import add_triangulator
from drake_tracker.vision.centroid import FrameDifference, NormalFlowDetector, add_motion_centroid, add_plane_projector

PERIOD = 1.0 / 50.0
SPEED, HEIGHT = 0.25, 0.1
"""Of the sliding box: its speed [m/s] and the height of its centre [m]."""


def add_sliding_box(builder):
    """A plant with a bright box that slides along x; returns (plant, scene graph)."""
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    box = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(1.0, 0.12, 0.06, 0.06))
    plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), box.body_frame(), [1, 0, 0]))
    plant.RegisterVisualGeometry(box, RigidTransform([0, 0, HEIGHT]), Box(0.12, 0.06, 0.06), "box", [0.9, 0.9, 0.9, 1])
    ground = RigidTransform([0, 0, -0.005])
    plant.RegisterVisualGeometry(plant.world_body(), ground, Box(3, 3, 0.01), "table", [0.2, 0.2, 0.2, 1])
    plant.Finalize()
    plant.get_mutable_joint(plant.GetJointByName("slide").index()).set_default_translation(-0.05)
    scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(RenderEngineVtkParams()))
    return plant, scene_graph


def look_at(p_WC, p_WQ=(0.0, 0.0, HEIGHT)):
    """X_WC of a camera at p_WC that looks at p_WQ: x to the right, y down, z forward."""
    forward = np.subtract(p_WQ, p_WC) / np.linalg.norm(np.subtract(p_WQ, p_WC))
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RigidTransform(RotationMatrix(np.column_stack([right, np.cross(forward, right), forward])), p_WC)


def build_your_own(builder, plant, scene_graph, size=(96, 72)):
    """What a guide shows: from two sensors on any plant to a predicted path. Returns the ports of point and path."""
    info = CameraInfo(*size, fov_y=0.5)
    core = RenderCameraCore("vtk", info, ClippingRange(0.1, 10.0), RigidTransform())
    cameras, centroids = [], []
    for X_WC in (look_at([-0.5, -0.9, 0.6]), look_at([0.5, -0.9, 0.6])):
        sensor = builder.AddSystem(
            RgbdSensor(scene_graph.world_frame_id(), X_WC, DepthRenderCamera(core, DepthRange(0.1, 9.0)))
        )
        builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
        centroid = add_motion_centroid(builder, image=sensor.color_image_output_port(), period=PERIOD)
        cameras.append(CameraModel.from_camera_info(info, X_WC))
        centroids.append(centroid.output_port)
    point = add_triangulator(builder, cameras=cameras, centroids=centroids).point_port
    estimator = add_estimator(builder, estimator=make_estimator("coordinated_turn"), point=point, period=PERIOD)
    return point, estimator.GetOutputPort("prediction")


def test_two_sensors_on_a_plant_of_your_own():
    assert len(inspect.getsource(build_your_own).splitlines()) < 25
    builder = DiagramBuilder()
    plant, scene_graph = add_sliding_box(builder)
    point, prediction = build_your_own(builder, plant, scene_graph)
    consumer = LogVectorOutput(point, builder, publish_period=PERIOD)
    simulator = Simulator(builder.Build())
    state = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.GetJointByName("slide").set_translation_rate(state, SPEED)
    simulator.AdvanceTo(6.5 * PERIOD)
    assert prediction.size() > 100
    points = [TrackPoint(row) for row in consumer.FindLog(simulator.get_context()).data().T]
    seen = [p for p in points if p.valid]
    # The middle one of five images, after the shortest lag of three cycles; logged before the updates of an instant.
    assert [round(p.stamp / PERIOD) for p in seen] == [2]
    # The cameras see the front and the top of the box, not its centre.
    assert (seen[0].x, seen[0].y, seen[0].z) == pytest.approx((-0.05 + SPEED * seen[0].stamp, 0.0, HEIGHT), abs=0.02)
    assert seen[0].gap < 0.01


def test_names_are_free_and_a_window_belongs_to_settings():
    builder = DiagramBuilder()
    parts = [add_motion_centroid(builder, detector=FrameDifference()) for _ in range(3)]
    assert [part.system.get_name() for part in parts] == ["motion", "motion_2", "motion_3"]
    assert [part.delay.get_name() for part in parts] == ["motion_lag", "motion_2_lag", "motion_3_lag"]
    with pytest.raises(DrakeTrackerError, match="a detector object has its own window"):
        add_motion_centroid(builder, detector=NormalFlowDetector(), window=np.ones((4, 4)))


def test_one_camera_and_a_plane():
    camera = CameraModel.from_camera_info(CameraInfo(96, 72, 0.5), look_at([-0.5, -0.9, 0.6]))
    X_WP = RigidTransform(RotationMatrix.MakeXRotation(0.2), [0.1, 0.0, 0.05])
    p_WQ = X_WP @ np.array([-0.08, 0.05, 0.03])
    builder = DiagramBuilder()
    projector = add_plane_projector(builder, camera=camera, X_WP=X_WP, height=0.03)
    simulator = Simulator(builder.Build())
    context = projector.GetMyContextFromRoot(simulator.get_context())
    projector.GetInputPort("centroid").FixValue(context, [0.1, *camera.project(p_WQ)[0], 50.0, 1.0])
    simulator.AdvanceTo(0.01)
    point = TrackPoint(projector.point_port.Eval(context))
    assert point.valid and (point.x, point.y, point.z) == pytest.approx(p_WQ, abs=1e-6)


def larger(camera):
    """The same camera as calibrated with images of twice the size."""
    return replace(camera, K=camera.K * [[2], [2], [1]], width=2 * camera.width, height=2 * camera.height)


def two_cameras(builder, *, sizes=((96, 72), (96, 72)), places=([-0.5, -0.9, 0.6], [0.5, -0.9, 0.6])):
    """Two sensors; returns their cameras, and the output ports of their centroids."""
    _, scene_graph = add_sliding_box(builder)
    cameras, centroids = [], []
    for size, place in zip(sizes, places):
        info, X_WC = CameraInfo(*size, fov_y=0.5), look_at(place)
        core = RenderCameraCore("vtk", info, ClippingRange(0.1, 10.0), RigidTransform())
        sensor = builder.AddSystem(
            RgbdSensor(scene_graph.world_frame_id(), X_WC, DepthRenderCamera(core, DepthRange(0.1, 9.0)))
        )
        centroids.append(add_motion_centroid(builder, image=sensor.color_image_output_port()).output_port)
        cameras.append(CameraModel.from_camera_info(info, X_WC))
    return cameras, centroids


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda cameras, centroids: (cameras[::-1], centroids), "the cameras are in another order than the centroids"),
        (lambda cameras, centroids: (cameras, centroids[::-1]), "the cameras are in another order than the centroids"),
        (lambda cameras, centroids: (cameras[:1], centroids[:1]), "1 cameras and 1 centroids; .* add_plane_projector"),
        (lambda cameras, centroids: (cameras * 2, centroids), "4 cameras and 2 centroids; a triangulator has two"),
        (lambda cameras, centroids: (cameras, centroids[:1]), "2 cameras and 1 centroids"),
        (
            lambda cameras, centroids: ([cameras[0], larger(cameras[1])], centroids),
            r"cameras\[1\] has 192 x 144 px and a focal length of 282 px, and the sensor .* 96 x 72 px and 141 px",
        ),
        (
            lambda cameras, centroids: ([replace(cameras[0], width=48), cameras[1]], centroids),
            r"cameras\[0\] has 48 x 72 px and a focal length of 141 px, and the sensor .* 96 x 72 px",
        ),
        (lambda cameras, centroids: ([cameras[0], cameras[0]], ()), "the two cameras are 0 mm apart"),
    ],
)
def test_mistakes_in_the_set_up_are_found_when_the_diagram_is_built(change, message):
    builder = DiagramBuilder()
    cameras, centroids = change(*two_cameras(builder))
    with pytest.raises(DrakeTrackerError, match=message) as caught:
        add_triangulator(builder, cameras=cameras, centroids=centroids)
    assert "\n" not in str(caught.value)


def test_calibrated_cameras_may_differ_from_the_sensors_a_little():
    builder = DiagramBuilder()
    cameras, centroids = two_cameras(builder)
    moved = [camera.in_frame(RigidTransform([0.01, 0.0, 0.02]).GetAsMatrix4()) for camera in cameras]
    add_triangulator(builder, cameras=moved, centroids=centroids)
