"""Tests that the markers of the hand are found in images, to a fraction of a pixel, and nothing else is."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from drums import draw_drum

from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.constants import SIDES
from drake_tracker.vision.hand.hand_markers import (
    HandMarkerFinder,
    MarkerSearch,
    _refined,
    marker_template,
    triangulate_hand,
)
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import true_camera_models

WINDOW = (0, 0, 256, 256)
UP = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
TABLE_Z = 0.485
PLACES = [(0.56, -0.15, 0.72, 0.3), (0.70, 0.05, 0.60, 1.4), (0.45, 0.10, 0.53, 2.6), (0.60, 0.18, 0.50, 0.0)]
"""(x, y, z [m], yaw [rad]) of the middle between both markers; at none of them does one hide the other."""


@pytest.fixture(scope="module")
def cameras():
    models = true_camera_models(CamerasConfig())
    return {side: models[f"camera_{side}"] for side in SIDES}


def markers_at(x, y, z, yaw):
    """Centres of the left and the right marker of open jaws, shape (2, 3) [m]."""
    across = 0.058 * np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    return np.array([x, y, z]) + [across, -across]


def picture(camera, p_WM, *, light=(0.0, 0.0), drawn=(0, 1), swapped=False, seed=0):
    """An image of a textured scene with the markers."""
    rng = np.random.default_rng(seed)
    image = 60.0 + cv2.GaussianBlur(rng.normal(0.0, 40.0, (256, 256)), (0, 0), 3.0)
    nearest_last = sorted(drawn, key=lambda k: -np.linalg.norm(p_WM[k] - camera.X_WC[:3, 3]))
    for k in nearest_last:
        draw_drum(image, camera, p_WM[k], (k == 0) != swapped, light)
    return np.clip(image + rng.normal(0.0, 2.0, image.shape), 0, 255).astype(np.uint8)


def wrong(camera, degrees, metres):
    """The model of a camera, turned about the vertical axis and moved to its left."""
    X_WC = np.array(camera.X_WC)
    X_WC[:3, :3] = cv2.Rodrigues(np.array([0.0, 0.0, np.deg2rad(degrees)]))[0] @ X_WC[:3, :3]
    X_WC[:3, 3] -= metres * X_WC[:3, 0]
    return replace(camera, X_CW=np.linalg.inv(X_WC))


@pytest.mark.parametrize("light", [(0.0, 0.0), (0.3, 0.0), (-0.2, 0.25)])
def test_both_markers_are_found_to_a_fraction_of_a_pixel(cameras, light):
    for place in PLACES:
        p_WM = markers_at(*place)
        for camera in cameras.values():
            found = HandMarkerFinder(camera, WINDOW).find(picture(camera, p_WM, light=light), p_WM, UP)
            assert found is not None and found.markers == 2
            # The lit side of a drum counts more, by less than half a pixel.
            assert np.abs(found.uv - camera.project(p_WM).mean(axis=0)).max() < (0.15 if light == (0.0, 0.0) else 0.45)
            np.testing.assert_allclose(found.predicted, camera.project(p_WM.mean(axis=0))[0])
            assert found.contrast > 80.0


def test_the_displacement_is_found_over_the_whole_reach(cameras):
    camera = cameras["left"]
    p_WM = markers_at(*PLACES[0])
    image = picture(camera, p_WM)
    for offset in ([0.03, -0.02, 0.0], [-0.025, 0.0, 0.02], [0.0, 0.0, -0.03]):
        found = HandMarkerFinder(camera, WINDOW).find(image, p_WM + offset, UP)
        assert np.abs(found.uv - camera.project(p_WM).mean(axis=0)).max() < 0.3
    assert HandMarkerFinder(camera, WINDOW).find(image, p_WM + [0.0, 0.0, 0.09], UP) is None
    assert HandMarkerFinder(camera, WINDOW, MarkerSearch(reach=0.01)).find(image, p_WM + [0, 0, 0.03], UP) is None


def test_nothing_but_the_markers_is_found(cameras):
    camera = cameras["right"]
    p_WM = markers_at(*PLACES[1])
    finder = HandMarkerFinder(camera, WINDOW)
    for seed in range(20):
        assert finder.find(picture(camera, p_WM, drawn=(), seed=seed), p_WM, UP) is None
    assert finder.find(picture(camera, p_WM, swapped=True), p_WM, UP) is None
    assert finder.find(picture(camera, p_WM), p_WM + [0.0, 0.0, 2.0], UP) is None  # outside of the image


def test_one_marker_is_enough(cameras):
    p_WM = markers_at(*PLACES[0])
    for camera in cameras.values():
        for k in (0, 1):
            found = HandMarkerFinder(camera, WINDOW).find(picture(camera, p_WM, drawn=(k,)), p_WM, UP)
            assert found.markers == 1
            np.testing.assert_allclose(found.predicted, camera.project(p_WM[k])[0])
            assert np.abs(found.uv - camera.project(p_WM[k])[0]).max() < 0.3


def test_an_ambiguous_place_is_refused(cameras):
    camera = cameras["left"]
    p_WM = markers_at(*PLACES[0])
    image = picture(camera, p_WM)
    assert HandMarkerFinder(camera, WINDOW).find(image, p_WM, UP) is not None
    twins = 0.5 * (image.astype(float) + np.roll(image, -11, axis=1))  # the same markers again, 11 px beside them
    assert HandMarkerFinder(camera, WINDOW).find(twins.astype(np.uint8), p_WM, UP) is None


def test_the_template_is_balanced_and_centred():
    template = marker_template(340.0, np.array([0.0, -1.0]), 0.35)
    assert len(template) % 2 == 1
    assert template.sum() == pytest.approx(0.0, abs=1e-6)
    assert template[template > 0].sum() == pytest.approx(1.0, abs=1e-6)
    # The nearest part of the drum appears lower than its axis.
    rows = np.arange(len(template)) - len(template) // 2
    assert rows @ np.maximum(template, 0).sum(axis=1) == pytest.approx(340.0 * 0.35 * 0.014 * np.pi / 4, abs=0.1)


def test_a_wrong_calibration_displaces_hand_and_object_alike(cameras):
    known = {"left": cameras["left"], "right": wrong(cameras["right"], 1.0, 0.01)}
    for x, y, z, yaw in PLACES:
        p_WM = markers_at(x, y, z, yaw)
        p_WT = p_WM.mean(axis=0) - [0.0, 0.0, 0.04]
        below = np.array([x, y, TABLE_Z])
        images = [picture(cameras[side], p_WM) for side in SIDES]
        found = [HandMarkerFinder(known[s], WINDOW).find(image, p_WM, UP) for s, image in zip(SIDES, images)]
        hand = triangulate_hand([known[s] for s in SIDES], found, p_WT, TABLE_Z, 0.03)
        pixels = [cameras[s].project(below)[0] for s in SIDES]
        seen = triangulate(known["left"], known["right"], *pixels).p_WQ
        assert 0.02 < np.linalg.norm(seen - below) < 0.05
        assert np.linalg.norm((hand.p_WT - p_WT) - (seen - below)) < 0.004
        assert hand.markers == 4


def test_the_hand_is_seen_by_both_cameras_or_not_at_all(cameras):
    p_WM = markers_at(*PLACES[0])
    pair = [cameras[side] for side in SIDES]
    found = [HandMarkerFinder(camera, WINDOW).find(picture(camera, p_WM), p_WM, UP) for camera in pair]
    assert triangulate_hand(pair, [found[0], None], p_WM[0], TABLE_Z, 0.03) is None
    lifted = found[1]._replace(uv=found[1].uv - [0.0, 15.0])  # the rays pass each other
    assert triangulate_hand(pair, [found[0], lifted], p_WM[0], TABLE_Z, 0.03) is None


@pytest.mark.parametrize(("down", "right"), [(0, 0), (1, 0), (-1, 1), (2, -2)])
def test_the_maximum_of_a_marker_is_found_beside_the_place_of_both(down, right):
    rows, columns = np.mgrid[:21, :21]
    response = np.exp(-0.05 * ((rows - 10.3 - down) ** 2 + (columns - 9.8 - right) ** 2))
    assert _refined(response, 10, 10) == pytest.approx([9.8 + right, 10.3 + down], abs=0.02)
    assert _refined(response, 0, 10) is None
