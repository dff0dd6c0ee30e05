import numpy as np
import pytest

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import intersect_rays, triangulate

K = np.array([[478.0, 0.0, 127.5], [0.0, 478.0, 127.5], [0.0, 0.0, 1.0]])


def look_at(azimuth_deg, distortion=np.zeros(5), distance=1.4, elevation_deg=25.0, target=(0.56, 0.0, 0.47)):
    """A camera that looks at a point from a given direction."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    back = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    z = -back
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R_CW = np.array([x, np.cross(z, x), z])
    X_CW = np.eye(4)
    X_CW[:3, :3] = R_CW
    X_CW[:3, 3] = -R_CW @ (np.array(target) + distance * back)
    return CameraModel(K, distortion, X_CW, 256, 256)


@pytest.mark.parametrize("distortion", [np.zeros(5), np.array([-0.2, 0.05, 0.002, -0.001, 0.0])])
def test_finds_the_point_that_was_projected(distortion):
    left, right = look_at(45.0, distortion), look_at(-45.0, distortion)
    for p_WQ in np.random.default_rng(0).uniform([0.4, -0.25, 0.45], [0.7, 0.25, 0.55], (20, 3)):
        meeting = triangulate(left, right, left.project(p_WQ)[0], right.project(p_WQ)[0])
        assert meeting.p_WQ == pytest.approx(p_WQ, abs=1e-6)
        assert meeting.gap < 1e-6


def test_centre_of_the_image_sees_what_the_camera_looks_at():
    left, right = look_at(45.0), look_at(-45.0)
    meeting = triangulate(left, right, (127.5, 127.5), (127.5, 127.5))
    assert meeting.p_WQ == pytest.approx([0.56, 0.0, 0.47], abs=1e-9)


def test_midpoint_of_the_common_perpendicular():
    along_x = (np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    along_y = (np.array([0.0, -2.0, 0.2]), np.array([0.0, 1.0, 0.0]))
    meeting = intersect_rays(along_x, along_y)
    assert meeting.p_WQ == pytest.approx([0.0, 0.0, 0.1])
    assert meeting.gap == pytest.approx(0.2)


def test_midpoint_is_nearest_to_both_rays():
    rng = np.random.default_rng(2)
    for _ in range(20):
        target = np.array([0.0, 0.0, 5.0])
        origins = np.array([[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0]]) + 0.3 * rng.normal(size=(2, 3))
        directions = target + rng.normal(scale=0.3, size=(2, 3)) - origins
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        meeting = intersect_rays(*zip(origins, directions))

        def distances(point, origins=origins, directions=directions):
            offsets = point - origins
            along = (offsets * directions).sum(axis=1, keepdims=True)
            return np.linalg.norm(offsets - along * directions, axis=1)

        assert distances(meeting.p_WQ) == pytest.approx([meeting.gap / 2] * 2, abs=1e-9)
        worse = [distances(meeting.p_WQ + step).max() for step in 1e-3 * rng.normal(size=(20, 3))]
        assert min(worse) > meeting.gap / 2 - 1e-12


def test_rays_that_do_not_meet():
    x = np.array([1.0, 0.0, 0.0])
    assert intersect_rays((np.zeros(3), x), (np.array([0.0, 1.0, 0.0]), x)) is None
    # Lines that cross behind the second camera.
    assert intersect_rays((np.zeros(3), x), (np.array([1.0, 1.0, 0.0]), np.array([0.0, 1.0, 0.0]))) is None
