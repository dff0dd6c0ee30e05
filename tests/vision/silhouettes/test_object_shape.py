from dataclasses import replace

import numpy as np
import pytest
from cuboids import CAMERAS, Cuboid, oval

from drake_tracker.vision.silhouettes.object_shape import ObjectShape, outline_area, polygon_slant
from drake_tracker.vision.silhouettes.stereo_geometry import projection_jacobian

TRAIN = (0.11, 0.04, 0.05)
PERIOD = 1 / 60


def views(cuboid, p_WQ, heading):
    """(jacobians, extents, pixels) of the silhouettes of a cuboid in both images, without rounding to pixels."""
    extents, pixels = [], []
    for camera in CAMERAS:
        outline = cuboid.outline(camera, p_WQ, heading)
        extents.append(np.ptp(outline, axis=0))
        u, v = outline.T
        pixels.append(0.5 * abs(u @ np.roll(v, 1) - v @ np.roll(u, 1)))
    jacobians = np.array([projection_jacobian(camera, p_WQ) for camera in CAMERAS])
    return jacobians, np.array(extents), np.array(pixels)


def learn(dimensions, count, first=0.0, speed=0.15, noise=0.0, turn=True, seed=0):
    """The shape of a cuboid after ``count`` pairs of images on the oval."""
    rng = np.random.default_rng(seed)
    cuboid, shape = Cuboid(dimensions), None
    for k in range(count):
        p_WQ, velocity = oval(first + k * PERIOD, speed)
        jacobians, extents, pixels = views(cuboid, p_WQ, np.arctan2(velocity[1], velocity[0]))
        extents = extents + rng.normal(0.0, noise, extents.shape)
        if shape is None:
            shape = ObjectShape.guess(jacobians, extents)
        shape = (shape.turned(velocity) if turn else shape).learned(jacobians, extents, pixels)
    return shape


@pytest.mark.parametrize("dimensions", [TRAIN, (0.08, 0.05, 0.03), (0.06, 0.06, 0.06), (0.2, 0.03, 0.04)])
def test_the_box_is_recovered_along_a_curved_path(dimensions):
    shape = learn(dimensions, 240)
    # Perspective bends the linear model of long boxes.
    np.testing.assert_allclose(shape.dimensions, dimensions, atol=0.002 + 0.05 * max(dimensions))
    assert shape.settled


def test_the_box_is_recovered_from_extents_in_whole_pixels():
    shape = learn(TRAIN, 400, noise=0.6)
    np.testing.assert_allclose(shape.dimensions, TRAIN, atol=0.006)


def test_a_box_fills_its_own_outline():
    assert learn(TRAIN, 300).fill == pytest.approx(1.0, abs=0.05)


def test_the_first_guess_is_a_cube_of_the_right_size():
    side = 0.05
    cube = Cuboid((side,) * 3)
    p_WQ, _ = oval(0.0, 0.15)
    jacobians, extents, _ = views(cube, p_WQ, 0.0)
    shape = ObjectShape.guess(jacobians, extents)
    np.testing.assert_allclose(shape.dimensions, side, rtol=0.05)
    assert np.ptp(shape.dimensions) == 0.0 and not shape.settled


def test_the_guess_is_left_within_a_second():
    shape = learn(TRAIN, 60)
    assert shape.dimensions[0] > 1.5 * shape.dimensions[1]


def test_one_camera_alone_is_enough_to_begin_with():
    p_WQ, velocity = oval(0.0, 0.15)
    jacobians, extents, pixels = views(Cuboid(TRAIN), p_WQ, np.arctan2(velocity[1], velocity[0]))
    shape = ObjectShape.guess(jacobians[:1], extents[:1]).turned(velocity)
    for _ in range(10):
        shape = shape.learned(jacobians[:1], extents[:1], pixels[:1])
    assert np.isfinite(shape.dimensions).all() and (shape.dimensions > 0.0).all()
    expected = np.abs(jacobians[0] @ shape.edges).sum(axis=1)
    np.testing.assert_allclose(expected, extents[0], rtol=0.1)


def test_no_dimension_vanishes():
    p_WQ, _ = oval(0.0, 0.15)
    jacobians = np.array([projection_jacobian(camera, p_WQ) for camera in CAMERAS])
    shape = ObjectShape.guess(jacobians, np.array([[2.0, 2.0], [2.0, 2.0]]))
    for _ in range(300):
        shape = shape.learned(jacobians, np.array([[30.0, 1.0], [30.0, 1.0]]), np.array([30.0, 30.0]))
    assert (shape.dimensions >= 0.009).all()


def test_the_heading_is_that_of_the_path_unless_the_object_is_slow():
    shape = learn(TRAIN, 1)
    turned = shape.turned(np.array([0.0, 0.15, 0.0]))
    assert turned.heading == pytest.approx(np.pi / 2)
    assert turned.turned(np.array([0.001, -0.001, 0.0])).heading == turned.heading
    assert turned.turned(np.array([0.0, 0.0, 0.5])).heading == turned.heading, "it rises"


def test_the_edges_are_those_of_the_turned_box():
    shape = ObjectShape(np.array(TRAIN), np.pi / 6, np.eye(3), np.zeros(3))
    np.testing.assert_allclose(np.linalg.norm(shape.edges, axis=0), TRAIN)
    np.testing.assert_allclose(shape.edges[:, 0], [0.11 * np.cos(np.pi / 6), 0.11 * np.sin(np.pi / 6), 0.0])
    assert shape.edges.T @ shape.edges == pytest.approx(np.diag(np.square(TRAIN)), abs=1e-12)


def test_the_area_of_an_outline():
    assert outline_area(np.array([[3.0, 0.0, 0.0], [0.0, 2.0, 0.0]])) == pytest.approx(6.0)
    # A unit cube seen along its diagonal: a regular hexagon with sides of sqrt(2/3).
    diagonal = np.linalg.svd(np.ones((1, 3)))[2][1:]
    assert outline_area(diagonal) == pytest.approx(np.sqrt(3.0))


def test_a_standing_object_has_the_heading_of_its_silhouettes():
    """It stopped just after a corner, so that its path tells another heading."""
    p_WQ, heading = np.array([0.56, 0.0, 0.485]), np.radians(70.0)
    outlines = [Cuboid(TRAIN).outline(camera, p_WQ, heading) for camera in CAMERAS]
    jacobians = np.array([projection_jacobian(camera, p_WQ) for camera in CAMERAS])
    extents = np.array([np.ptp(outline, axis=0) for outline in outlines])
    slants = np.array([polygon_slant(outline.astype(np.float32)) for outline in outlines])
    shape = ObjectShape(np.array(TRAIN), np.radians(20.0), np.eye(3), np.zeros(3))
    found = shape.at_rest(jacobians, extents, slants)
    assert found.resting and found.heading == pytest.approx(heading, abs=np.radians(4.0))
    # The half turn is that of the heading before.
    found = replace(shape, heading=np.radians(230.0)).at_rest(jacobians, extents, slants)
    assert found.heading == pytest.approx(heading + np.pi, abs=np.radians(4.0))
    assert not found.turned(np.array([0.1, 0.0, 0.0])).resting, "it moves again"
    # Silhouettes that fit no heading tell nothing.
    assert shape.at_rest(jacobians, 2.0 * extents, slants) is shape
