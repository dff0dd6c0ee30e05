import cv2
import numpy as np
import pytest
from cuboids import CAMERAS, TRAIN, Cuboid

from drake_tracker.vision.silhouettes.object_shape import outline_slant, polygon_slant, silhouette_heading
from drake_tracker.vision.silhouettes.outline_fit import box_outline
from drake_tracker.vision.silhouettes.stereo_geometry import projection_jacobian

PLACES = [(0.56, 0.0, 0.485), (0.4, 0.2, 0.485), (0.7, -0.2, 0.485)]


def views(p_WQ, heading, dimensions=TRAIN, noise=0.0):
    """(jacobians, extents, slants) of the silhouettes of a cuboid in both images."""
    rng = np.random.default_rng(1)
    outlines = [Cuboid(dimensions).outline(camera, p_WQ, heading) for camera in CAMERAS]
    hulls = [
        cv2.convexHull((outline + rng.normal(0.0, noise, outline.shape)).astype(np.float32)) for outline in outlines
    ]
    jacobians = np.array([projection_jacobian(camera, np.array(p_WQ)) for camera in CAMERAS])
    extents = np.array([np.ptp(hull[:, 0], axis=0) for hull in hulls])
    return jacobians, extents, np.array([polygon_slant(hull) for hull in hulls])


def turned(found, heading):
    """The error of a direction, up to half a turn [deg]."""
    return np.degrees(abs((found - heading + np.pi / 2) % np.pi - np.pi / 2))


@pytest.mark.parametrize("p_WQ", PLACES)
def test_the_direction_is_found_wherever_the_train_stands(p_WQ):
    headings = np.radians(np.arange(-90.0, 270.0, 13.0))
    found = [silhouette_heading(np.array(TRAIN), *views(p_WQ, heading, noise=0.3)) for heading in headings]
    known = [(each, heading) for each, heading in zip(found, headings) if each is not None]
    assert len(known) >= 0.85 * len(headings)
    for each, heading in known:
        assert turned(each, heading) < 5.0, np.degrees(heading)


def test_an_object_that_looks_the_same_from_all_sides_has_no_direction():
    for heading in np.radians(np.arange(0.0, 90.0, 15.0)):
        assert silhouette_heading(np.full(3, 0.05), *views(PLACES[0], heading, (0.05, 0.05, 0.05))) is None


def test_silhouettes_that_are_those_of_another_object_have_no_direction():
    jacobians, extents, slants = views(PLACES[0], 0.5)
    assert silhouette_heading(np.array(TRAIN), jacobians, 1.5 * extents, slants) is None


def test_the_slant_of_an_area():
    along, across = np.array([[0, 0], [12, 0], [12, 2], [0, 2]], np.int32), np.array([[0, 0], [9, 9], [8, 9]], np.int32)
    assert polygon_slant(along) == pytest.approx(0.0, abs=1e-9)
    assert polygon_slant(across) > 0.0 and polygon_slant(across * [1, -1]) < 0.0
    # A thin line at 45 deg: its variances along u and v are l^2/24 each, and so is their covariance.
    line = np.array([[0.0, 0.01], [0.01, 0.0], [60.01, 60.0], [60.0, 60.01]], np.float32)
    assert polygon_slant(line) == pytest.approx(np.hypot(60.0, 60.0) / 24 / np.sqrt(1 / 12), rel=1e-3)
    assert polygon_slant(np.array([[1, 1], [5, 5]], np.int32)) == 0.0, "no area"


def test_the_slant_of_a_box_is_that_of_its_outline():
    edges = np.random.default_rng(0).normal(0.0, 20.0, (50, 2, 3))
    expected = [polygon_slant(box_outline(each)) for each in edges]
    np.testing.assert_allclose(outline_slant(edges), expected, atol=1e-3)
    np.testing.assert_array_equal(outline_slant(edges[:4].reshape(2, 2, 2, 3)), outline_slant(edges[:4]).reshape(2, 2))
    assert np.isfinite(outline_slant(np.zeros((1, 2, 3)))).all()
