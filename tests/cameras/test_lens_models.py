"""The wider lenses, against OpenCV's own functions, and everything that a camera does through them."""

import cv2
import numpy as np
import pytest

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration, save_calibration
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.vision.centroid.plane_projection import project_to_plane
from drake_tracker.vision.silhouettes.stereo_geometry import projection_jacobian

K = np.array([[300.0, 0.0, 330.5], [0.0, 310.0, 235.0], [0.0, 0.0, 1.0]])
RATIONAL = [0.5, 0.11, 0.0007, -0.0004, 0.02, 0.85, 0.2, 0.05]
FISHEYE = [-0.013, 0.021, -0.02, 0.004]
LENSES = [("pinhole", RATIONAL, 1.2), ("fisheye", FISHEYE, 5.0)]


def camera(lens, distortion, X_CW=np.eye(4)):
    return CameraModel(K, distortion, X_CW, 640, 480, lens)


def points(widest, count=200):
    """Points in front of the camera, up to ``widest`` times their distance away from the axis."""
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.5, 2.0, count)
    return np.column_stack([depth[:, np.newaxis] * rng.uniform(-widest, widest, (count, 2)) / 1.5, depth])


def opencv_pixels(lens, distortion, p_CQ):
    none, D = np.zeros(3), np.array(distortion)
    if lens == "fisheye":
        return cv2.fisheye.projectPoints(p_CQ[:, np.newaxis], none, none, K, D)[0][:, 0]
    return cv2.projectPoints(p_CQ, none, none, K, D)[0][:, 0]


@pytest.mark.parametrize(("lens", "distortion", "widest"), LENSES)
def test_projects_as_opencv_and_back(lens, distortion, widest):
    p_CQ = np.vstack([points(widest), [0.0, 0.0, 1.0]])
    model = camera(lens, distortion)
    uv = model.project(p_CQ)
    np.testing.assert_allclose(uv, opencv_pixels(lens, distortion, p_CQ), atol=1e-9)
    directions = p_CQ / np.linalg.norm(p_CQ, axis=1, keepdims=True)
    np.testing.assert_allclose(model.rays(uv)[1], directions, atol=1e-9)
    np.testing.assert_allclose(model.ray(*uv[3])[1], directions[3], atol=1e-9)


@pytest.mark.parametrize(("lens", "distortion", "widest"), LENSES)
def test_a_pixel_that_no_ray_reaches_still_has_a_ray(lens, distortion, widest):
    rays = camera(lens, distortion).rays([[1e5, -1e5], [-3e4, 0.0], [640.0, 480.0]])[1]
    assert np.isfinite(rays).all() and (rays[:, 2] > 0.0).all()


@pytest.mark.parametrize(("lens", "distortion", "widest"), LENSES)
def test_two_cameras_and_a_plane_give_back_the_point(lens, distortion, widest):
    X_RW = np.eye(4)
    X_RW[:3] = np.column_stack([cv2.Rodrigues(np.array([0.02, 0.2, -0.05]))[0], [-0.3, 0.02, 0.05]])
    left, right = camera(lens, distortion), camera(lens, distortion, X_RW)
    for p_WQ in points(0.6, 20):
        meeting = triangulate(left, right, *(each.project(p_WQ)[0] for each in (left, right)))
        np.testing.assert_allclose(meeting.p_WQ, p_WQ, atol=1e-7)
        X_WP = np.eye(4)
        X_WP[2, 3] = p_WQ[2] + 0.1  # the point is 0.1 m before the plane
        on_plane = project_to_plane(right.in_frame(X_WP), right.project(p_WQ)[0], -0.1)
        np.testing.assert_allclose(on_plane + X_WP[:3, 3], p_WQ, atol=1e-7)


@pytest.mark.parametrize(("lens", "distortion", "widest"), LENSES)
def test_the_derivative_includes_the_lens(lens, distortion, widest):
    model, p_WQ = camera(lens, distortion), np.array([0.7, -0.4, 1.0])
    step = np.array([2e-4, 1e-4, -1e-4])
    moved = model.project(p_WQ + step)[0] - model.project(p_WQ - step)[0]
    np.testing.assert_allclose(projection_jacobian(model, p_WQ) @ (2.0 * step), moved, rtol=1e-4)


@pytest.mark.parametrize(("lens", "distortion", "widest"), LENSES)
def test_a_file_gives_back_the_lens(tmp_path, lens, distortion, widest):
    save_calibration(tmp_path / "wide.yaml", {"camera_left": camera(lens, distortion)})
    found = load_calibration(tmp_path / "wide.yaml")["camera_left"]
    assert found.lens == lens
    p_CQ = points(widest)
    np.testing.assert_allclose(found.project(p_CQ), camera(lens, distortion).project(p_CQ), atol=1e-5)


def test_refuses_another_lens_or_number_of_coefficients():
    with pytest.raises(ValueError, match="lens is 'mirror'; it must be one of pinhole, fisheye"):
        camera("mirror", FISHEYE)
    with pytest.raises(ValueError, match=r"distortion has shape \(5,\); it must be \(4,\)"):
        camera("fisheye", np.zeros(5))
