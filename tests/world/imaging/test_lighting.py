import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.imaging.camera_system import add_cameras
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, true_camera_models
from drake_tracker.world.imaging.lighting import make_lights, render_engine_params

HEIGHT = 0.05
CONFIG = CamerasConfig(width=96, height=96, fov_deg=15.0, noise=0.0)
AIM = {"azimuths_deg": CONFIG.azimuth_deg, "look_at": CONFIG.look_at}


def images(lighting):
    """What both cameras see of a block on a table: {name: grey (96, 96)}."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    world = plant.world_body()
    block, table = RigidTransform([0.56, 0.0, 0.45 + HEIGHT / 2]), RigidTransform([0.56, 0.0, 0.44])
    plant.RegisterVisualGeometry(world, block, Box(0.1, 0.1, HEIGHT), "block", np.array([0.8, 0.8, 0.8, 1.0]))
    plant.RegisterVisualGeometry(world, table, Box(0.6, 0.6, 0.02), "table", np.array([0.3, 0.3, 0.3, 1.0]))
    plant.Finalize()
    cameras = add_cameras(builder, scene_graph=scene_graph, config=CONFIG, lighting=lighting)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    return {
        name: camera.image_port.Eval(camera.sensor.GetMyContextFromRoot(context)).data[..., 0].astype(float)
        for name, camera in cameras.items()
    }


def brightness(pictures, name, p_WQ):
    u, v = np.rint(true_camera_models(CONFIG)[name].project([p_WQ])[0]).astype(int)
    return pictures[name][v, u]


FACE_X = [0.61, 0.0, 0.475]
FACE_LEFT, FACE_RIGHT = [0.56, 0.05, 0.475], [0.56, -0.05, 0.475]
TOP = [0.56, 0.0, 0.50]


def test_lamps_above_the_cameras_light_every_face_that_is_seen():
    pictures = images(LightingConfig())
    seen = [
        brightness(pictures, name, p_WQ)
        for name, faces in zip(CAMERA_NAMES, ((FACE_LEFT, FACE_X, TOP), (FACE_RIGHT, FACE_X, TOP)))
        for p_WQ in faces
    ]
    assert min(seen) > 90 and max(seen) < 250
    assert max(seen) / min(seen) < 1.8
    np.testing.assert_allclose(seen[:3], seen[3:], atol=3)


def test_light_from_one_side_leaves_the_other_dark():
    pictures = images(LightingConfig(side="one_side"))
    assert brightness(pictures, "camera_left", FACE_LEFT) > 3 * brightness(pictures, "camera_right", FACE_RIGHT)
    assert brightness(pictures, "camera_right", FACE_RIGHT) > 3


def test_shadows_fall_only_when_asked_for():
    behind_the_block, in_the_open = [0.56, -0.09, 0.45], [0.66, -0.09, 0.45]
    ratios = []
    for shadows in (False, True):
        pictures = images(LightingConfig(side="one_side", shadows=shadows))
        ratios.append(
            brightness(pictures, "camera_right", behind_the_block) / brightness(pictures, "camera_right", in_the_open)
        )
    assert ratios[0] > 0.9 and ratios[1] < 0.7


def test_shadows_leave_what_is_lit_as_bright_as_it_was():
    plain, shaded = images(LightingConfig()), images(LightingConfig(shadows=True))
    for p_WQ in (TOP, FACE_X, FACE_LEFT):
        before = brightness(plain, "camera_left", p_WQ)
        assert brightness(shaded, "camera_left", p_WQ) == pytest.approx(before, rel=0.25)


def test_parameters_carry_the_choice():
    params = render_engine_params(LightingConfig(side="one_side", shadows=True), **AIM)
    assert params.cast_shadows and len(params.lights) == len(make_lights(LightingConfig(side="one_side"), **AIM))
    assert not render_engine_params(LightingConfig(), **AIM).cast_shadows


def test_an_unknown_side_is_refused():
    with pytest.raises(DrakeTrackerError, match="lighting.side is 'north'; it must be one of cameras, one_side"):
        make_lights(LightingConfig(side="north"), **AIM)
