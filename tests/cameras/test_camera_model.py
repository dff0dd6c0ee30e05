import cv2
import numpy as np
import pytest

from drake_tracker.cameras.camera_model import CameraModel

K = np.array([[500.0, 0.0, 127.5], [0.0, 400.0, 95.5], [0.0, 0.0, 1.0]])
LENS = [-0.28, 0.09, 0.001, -0.002, 0.01]


def looking_along_y(distortion=(0.0,) * 5):
    """A camera at (0, -2, 1) that looks along W's y axis."""
    R_CW = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    X_CW = np.eye(4)
    X_CW[:3, :3] = R_CW
    X_CW[:3, 3] = -R_CW @ [0.0, -2.0, 1.0]
    return CameraModel(K, distortion, X_CW, 256, 192)


def test_projects_by_the_pinhole_equation():
    camera = looking_along_y()
    uv = camera.project([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.0, 0.0, 1.1], [0.1, 2.0, 1.1]])
    np.testing.assert_allclose(uv, [[127.5, 95.5], [152.5, 95.5], [127.5, 75.5], [140.0, 85.5]])


def test_distorts_by_the_published_polynomial():
    k1, k2, p1, p2, k3 = LENS
    x, y = 0.2, -0.15
    r2 = x * x + y * y
    radial = 1.0 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    expected = [
        500.0 * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + 127.5,
        400.0 * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + 95.5,
    ]
    p_WQ = [2.0 * x, 0.0, 1.0 - 2.0 * y]
    np.testing.assert_allclose(looking_along_y(LENS).project([p_WQ])[0], expected, atol=1e-9)


def test_a_point_behind_the_camera_has_no_image():
    camera = looking_along_y()
    uv = camera.project([[0.0, -3.0, 1.0], [0.0, 0.0, 1.0], [0.0, -2.0, 1.0]])
    assert np.isnan(uv[[0, 2]]).all() and np.isfinite(uv[1]).all()
    assert camera.sees([[0.0, -3.0, 1.0], [0.0, 0.0, 1.0], [5.0, 0.0, 1.0]]).tolist() == [False, True, False]


@pytest.mark.parametrize("distortion", [(0.0,) * 5, LENS])
def test_rays_invert_projection(distortion):
    camera = looking_along_y(distortion)
    rng = np.random.default_rng(1)
    p_WQ = np.column_stack([rng.uniform(-0.5, 0.5, 50), rng.uniform(-0.2, 0.2, 50), 1.0 + rng.uniform(-0.4, 0.4, 50)])
    origin, directions = camera.rays(camera.project(p_WQ))
    np.testing.assert_allclose(origin, [0.0, -2.0, 1.0], atol=1e-12)
    along = p_WQ - origin
    np.testing.assert_allclose(directions, along / np.linalg.norm(along, axis=1, keepdims=True), atol=1e-8)


def test_no_pixels_give_no_rays():
    assert looking_along_y().rays(np.empty((0, 2)))[1].shape == (0, 3)


def test_the_arrays_are_the_models_own():
    matrix = K.copy()
    camera = CameraModel(matrix, np.zeros(5), np.eye(4), 256, 192)
    matrix[0, 0] = 1.0
    assert camera.K[0, 0] == 500.0
    with pytest.raises(ValueError, match="read-only"):
        camera.X_CW[0, 3] = 1.0


def test_refuses_other_shapes():
    with pytest.raises(ValueError, match=r"distortion has shape \(4,\)"):
        CameraModel(K, np.zeros(4), np.eye(4), 256, 192)


@pytest.mark.parametrize("distortion", [[0.0] * 5, [0.003, 0.0, 0.0, 0.0, 0.0], LENS])
def test_the_lens_and_single_rays_are_computed_as_by_the_general_functions(distortion):
    camera = CameraModel(K, distortion, np.eye(4), 256, 192)
    p_CQ = np.random.default_rng(0).uniform([-0.3, -0.3, 0.8], [0.3, 0.3, 1.6], (100, 3))
    expected = cv2.projectPoints(p_CQ, np.zeros(3), np.zeros(3), camera.K, camera.distortion)[0][:, 0]
    np.testing.assert_allclose(camera.project(p_CQ), expected, rtol=1e-14)
    for point, pixel in zip(p_CQ, expected):
        np.testing.assert_allclose(camera.project(point)[0], pixel, rtol=1e-14)
        np.testing.assert_array_equal(camera.ray(*pixel)[1], camera.rays([pixel])[1][0])
