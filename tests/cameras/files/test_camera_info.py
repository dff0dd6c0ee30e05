import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.sensors import CameraInfo

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import (
    camera_info,
    camera_poses,
    focal_length,
    renderable_window,
    true_camera_models,
)

X_WC = RigidTransform(RollPitchYaw(2.0, 0.1, -0.2), [0.3, -0.2, 1.1])


def test_the_principal_point_is_half_a_pixel_off_that_of_the_renderer():
    camera = CameraModel.from_camera_info(CameraInfo(64, 48, 80.0, 81.0, 30.0, 24.0), X_WC)
    np.testing.assert_array_equal(camera.K, [[80.0, 0.0, 29.5], [0.0, 81.0, 23.5], [0.0, 0.0, 1.0]])
    assert (camera.width, camera.height) == (64, 48) and not camera.distortion.any()
    np.testing.assert_allclose(camera.X_WC, X_WC.GetAsMatrix4(), atol=1e-15)


def test_the_cameras_of_the_world_are_those_of_their_sensors():
    config = CamerasConfig()
    f = focal_length(config.height, config.fov_deg)
    K = [[f, 0.0, (config.width - 1) / 2], [0.0, f, (config.height - 1) / 2], [0.0, 0.0, 1.0]]
    poses = camera_poses(config)
    for name, camera in true_camera_models(config).items():
        np.testing.assert_array_equal(camera.K, K)
        np.testing.assert_array_equal(camera.X_CW, poses[name].inverse().GetAsMatrix4())


def test_a_camera_that_renders_a_window_has_the_pixels_of_the_window():
    config, (u0, v0, width, height) = CamerasConfig(), renderable_window((40, 30, 150, 120), 256, 256)
    whole = CameraModel.from_camera_info(camera_info(256, 256, config.fov_deg), X_WC)
    part = CameraModel.from_camera_info(camera_info(256, 256, config.fov_deg, (u0, v0, width, height)), X_WC)
    p_WQ = X_WC.multiply(np.array([0.02, -0.03, 0.9]))
    assert part.project(p_WQ)[0] + (u0, v0) == pytest.approx(whole.project(p_WQ)[0], abs=1e-9)
