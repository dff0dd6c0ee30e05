import numpy as np
import pytest
from pydrake.geometry import Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.imaging.camera_system import CameraOptics, add_camera, add_cameras, add_renderer
from drake_tracker.world.imaging.cameras import (
    CAMERA_NAMES,
    camera_info,
    camera_pose,
    renderable_window,
    true_camera_models,
)
from drake_tracker.world.imaging.lighting import render_engine_params

SPHERE_RADIUS = 0.03


class Scene:
    """Spheres before the two cameras."""

    def __init__(self, centres, config, *, windows=None):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        for index, p_WQ in enumerate(centres):
            body = plant.AddRigidBody(f"ball{index}", plant.AddModelInstance(f"ball{index}"))
            plant.WeldFrames(plant.world_frame(), body.body_frame(), RigidTransform(p_WQ))
            plant.RegisterVisualGeometry(body, RigidTransform(), Sphere(SPHERE_RADIUS), "ball", [0.9, 0.8, 0.2, 1.0])
        plant.Finalize()
        self.cameras = add_cameras(
            builder, scene_graph=scene_graph, config=config, lighting=LightingConfig(), windows=windows, seed=3
        )
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()

    def eval(self, port):
        return port.Eval(port.get_system().GetMyContextFromRoot(self.context)).data.copy()


def test_pose_looks_at_the_point_and_follows_opencv():
    look_at = np.array([0.56, 0.0, 0.47])
    X_WC = camera_pose(45.0, 25.0, 1.4, look_at)
    np.testing.assert_allclose(X_WC.inverse() @ look_at, [0.0, 0.0, 1.4], atol=1e-12)
    x, y, z = X_WC.rotation().matrix().T
    assert x[2] == pytest.approx(0.0, abs=1e-12) and y[2] < 0.0
    assert z[2] == pytest.approx(-np.sin(np.deg2rad(25.0)))
    assert X_WC.translation()[0] > 0.56 and X_WC.translation()[1] > 0.0


@pytest.mark.parametrize(
    ("elevation_deg", "distance", "message"), [(90.0, 1.4, "elevation_deg is 90"), (25.0, 0.0, "distance is 0")]
)
def test_pose_refuses_what_leaves_it_undefined(elevation_deg, distance, message):
    with pytest.raises(DrakeTrackerError, match=message):
        camera_pose(45.0, elevation_deg, distance, [0.0, 0.0, 0.0])


def test_true_models_keep_the_half_pixel_apart():
    config = CamerasConfig()
    for name, model in true_camera_models(config).items():
        np.testing.assert_allclose(model.project([config.look_at]), [[127.5, 127.5]], atol=1e-9)
        assert model.K[0, 0] == pytest.approx(128.0 / np.tan(np.deg2rad(15.0)))
        info = camera_info(config.width, config.height, config.fov_deg)
        assert (info.center_x(), info.center_y()) == (128.0, 128.0), name


@pytest.mark.parametrize(
    ("window", "expected"),
    [
        ((10, 20, 200, 100), (10, 20, 118 + 82, 109)),
        ((-5, -5, 400, 400), (0, 0, 256, 256)),
        ((0, 0, 50, 50), (0, 0, 129, 129)),
        ((200, 130, 40, 60), (127, 127, 113, 63)),
    ],
)
def test_a_window_is_cut_and_keeps_the_centre(window, expected):
    found = renderable_window(window, 256, 256)
    assert found == expected
    info = camera_info(256, 256, 30.0, found)
    assert 0.0 < info.center_x() < info.width() and 0.0 < info.center_y() < info.height()


def test_a_window_outside_the_image_is_refused():
    with pytest.raises(DrakeTrackerError, match="does not overlap the image of 256 x 256 px"):
        renderable_window((300, 0, 20, 20), 256, 256)


def test_a_spheres_image_lies_where_the_true_model_says():
    """The centroid of a sphere's pixels: half a pixel of disagreement between the conventions would show."""
    config = CamerasConfig(noise=0.0)
    rng = np.random.default_rng(0)
    grid = np.array([[0.0, y, z] for y in (-0.1, 0.0, 0.1) for z in (-0.1, 0.0, 0.1)])
    centres = config.look_at + grid + rng.uniform(-0.004, 0.004, grid.shape)
    scene = Scene(centres, config)
    models = true_camera_models(config)
    for name in CAMERA_NAMES:
        labels = scene.eval(scene.cameras[name].sensor.label_image_output_port())[..., 0]
        misses = []
        for expected in models[name].project(centres):
            label = labels[tuple(np.rint(expected[::-1]).astype(int))]
            v, u = np.nonzero(labels == label)
            assert len(u) > 200
            misses.append([u.mean(), v.mean()] - expected)
        assert np.abs(np.mean(misses, axis=0)).max() < 0.05


def test_a_window_has_the_pixels_of_the_full_image_noise_and_all():
    config = CamerasConfig(width=96, height=80, fov_deg=12.0, noise=2.0)
    centres = [[0.56, -0.05, 0.45], [0.6, 0.06, 0.5]]
    windows = {"camera_left": (11, 20, 60, 37), "camera_right": (30, 8, 50, 60)}
    full, part = Scene(centres, config), Scene(centres, config, windows=windows)
    for name in CAMERA_NAMES:
        u0, v0, width, height = part.cameras[name].window
        assert (u0, v0, width, height) == windows[name]
        whole = full.eval(full.cameras[name].image_port)
        assert whole.shape == (80, 96, 4)
        window = part.eval(part.cameras[name].image_port).astype(int)
        cut = whole[v0 : v0 + height, u0 : u0 + width].astype(int)
        # The renderer's rounding is not quite the same: a few pixels in ten thousand differ by a grey level, or lie on
        # an outline and fall to its other side.
        assert np.mean(window != cut) < 0.003
        assert whole[..., 0].max() > 100


def test_cameras_are_named_and_noise_is_added_only_where_asked_for():
    scene = Scene([[0.56, 0.0, 0.47]], CamerasConfig(width=32, height=32, noise=0.0))
    for name in CAMERA_NAMES:
        camera = scene.cameras[name]
        assert camera.sensor.get_name() == name
        assert camera.image_port.get_system() is camera.sensor
    names = [system.get_name() for system in scene.diagram.GetSystems()]
    assert not [name for name in names if "noise" in name]


def test_a_camera_can_be_added_to_any_plant():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    plant.RegisterVisualGeometry(
        plant.world_body(), RigidTransform([0.3, 0.1, 0.2]), Sphere(SPHERE_RADIUS), "ball", [0.9, 0.9, 0.9, 1.0]
    )
    plant.Finalize()
    for _ in range(2):
        add_renderer(
            scene_graph,
            params=render_engine_params(LightingConfig(), azimuths_deg=(30.0, -30.0), look_at=(0.3, 0.1, 0.2)),
        )
    assert scene_graph.RendererCount() == 1
    X_WC = camera_pose(20.0, 30.0, 0.8, [0.3, 0.05, 0.2])
    camera = add_camera(
        builder,
        scene_graph=scene_graph,
        name="wrist",
        optics=CameraOptics(
            X_WC=X_WC, width=90, height=60, fov_deg=40.0, window=(20, 10, 60, 40), supersampling=2, noise=1.0
        ),
    )
    diagram = builder.Build()
    assert camera.window == (20, 10, 60, 40) and diagram.HasSubsystemNamed("wrist_noise")
    system = camera.image_port.get_system()
    image = camera.image_port.Eval(system.GetMyContextFromRoot(diagram.CreateDefaultContext())).data
    assert image.shape == (40, 60, 4)
    rows, columns = np.nonzero(image[..., 0] > 80)
    model = CameraModel.from_camera_info(camera_info(90, 60, 40.0), X_WC)
    expected = model.project([[0.3, 0.1, 0.2]])[0] - camera.window[:2]
    assert [columns.mean(), rows.mean()] == pytest.approx(expected, abs=0.5)
