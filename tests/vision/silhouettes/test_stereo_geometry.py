"""Tests of points that two cameras locate together, of which one is calibrated wrongly."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.stereo_geometry import StereoGeometry, projection_jacobian
from drake_tracker.vision.silhouettes.track_3d import GUESSED, HEIGHT_STD, Measurement, new_track
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import true_camera_models

P_WQ = np.array([0.60, 0.05, 0.48])


@pytest.fixture(scope="module")
def true_cameras():
    models = true_camera_models(CamerasConfig())
    return [models["camera_left"], models["camera_right"]]


@pytest.fixture(scope="module")
def geometry(true_cameras):
    """The right camera is turned by 1 degree about the vertical axis."""
    left, right = true_cameras
    X_WC = np.array(right.X_WC)
    X_WC[:3, :3] = cv2.Rodrigues(np.array([0.0, 0.0, np.deg2rad(1.0)]))[0] @ X_WC[:3, :3]
    wrong = replace(right, X_CW=np.linalg.inv(X_WC))
    return StereoGeometry([left, wrong], work_volume=None, margin=0.0, max_gap=0.03)


def test_offsets_are_zero_without_a_displacement(geometry):
    assert not geometry.offsets(P_WQ, [np.zeros(2), np.zeros(2)]).any()


def test_a_fit_to_both_images_agrees_with_the_triangulated_point(geometry, true_cameras):
    seen = [camera.project(P_WQ)[0] for camera in true_cameras]
    meeting = triangulate(*geometry.cameras, *seen)
    # The left image shows less of the object.
    regions = [SimpleNamespace(u=u, v=v, var_u=k, var_v=k, share=1.0) for k, (u, v) in zip((9.0, 1.0), seen)]
    displacements = [uv - camera.project(P_WQ)[0] for uv, camera in zip(seen, geometry.cameras)]
    # The displacement is known where the hand is, not where the object is.
    offsets = geometry.offsets(meeting.p_WQ + [0.03, -0.02, 0.0], displacements)

    def error(offsets):
        height = float(meeting.p_WQ[2])
        track = SimpleNamespace(
            position=P_WQ, expected_height=height, expected_height_std=HEIGHT_STD, height_free=False
        )
        fit = geometry.measure_at_height(track, regions, offsets)
        return np.linalg.norm(fit.p_WQ - meeting.p_WQ)

    assert meeting.gap > 0.005
    assert error(offsets) < 0.0005 < 0.002 < error(np.zeros((2, 2)))


@pytest.fixture
def climbing(geometry):
    """A track on a hill whose height is known to 5 mm."""
    shape = ObjectShape(np.array([0.1, 0.04, 0.05]), 0.0, np.eye(3), np.zeros(3))
    track = new_track(2.0, Measurement(P_WQ, 0.005**2 * np.eye(3), 0.001, 1.0), shape, (200.0, 170.0, 60.0))
    return replace(track.with_velocity(np.array([0.1, 0.0, 0.0]), 0.02), heights=(0.45, 0.50), stereo=10)


def seen_at(camera, p_WQ):
    u, v = camera.project(p_WQ)[0]
    return SimpleNamespace(u=u, v=v, var_u=1.0, var_v=1.0, share=1.0)


@pytest.mark.parametrize("side", [0, 1])
def test_one_image_does_not_confirm_the_height_that_was_predicted_on_a_hill(geometry, climbing, side):
    """Errors of 100 mm once counted as 9 mm, because the predicted height was held for known."""
    stds, level = [], replace(climbing, heights=(0.48, 0.48))
    for k in range(1, 31):
        place = P_WQ + [0.1 * k / 60, 0.0, -0.1 * k / 60]
        regions = [seen_at(geometry.cameras[side], place) if side == each else None for each in range(2)]
        climbing, level = (track.predicted(2.0 + k / 60) for track in (climbing, level))
        measurement = geometry.measure_at_height(climbing, regions, np.zeros((2, 2)))
        climbing = climbing.updated(measurement, shared=True)
        level = level.updated(geometry.measure_at_height(level, regions, np.zeros((2, 2))), shared=True)
        stds.append(np.sqrt(climbing.covariance[2, 2]))
    assert (np.diff(stds)[5:] > 0.0).all() and stds[-1] > 0.018
    assert np.sqrt(level.covariance[2, 2]) < 0.008
    error = measurement.p_WQ - place
    assert np.linalg.norm(error) > 0.05 and error @ np.linalg.solve(measurement.covariance, error) < 9.0


@pytest.mark.parametrize("error", [-0.01, 0.01])
def test_a_guessed_height_is_corrected(geometry, climbing, error):
    """Two trains that were merged from the start once kept a height that was wrong by 10 mm."""
    known = replace(climbing.placed(P_WQ + [0.0, 0.0, error], 0.01), height=P_WQ[2] + error, heights=(0.48, 0.48))
    known = known.with_velocity(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.1, 0.01]))
    tracks = [known, replace(known, heights=GUESSED, stereo=0)]
    assert all(track.height_known for track in tracks)
    for k in range(1, 61):
        place = P_WQ + [0.1 * k / 60, 0.0, 0.0]
        regions = [seen_at(camera, place) for camera in geometry.cameras]
        regions[1].var_u = regions[1].var_v = 12.0  # divided
        for i, track in enumerate(tracks):
            track = track.predicted(2.0 + k / 60)
            tracks[i] = track.updated(geometry.measure_at_height(track, regions, np.zeros((2, 2))), shared=True)
    remaining = [np.linalg.norm(track.position - place) for track in tracks]
    assert remaining[1] < 0.002 < 0.005 < remaining[0]
    assert tracks[1].expected_height == pytest.approx(P_WQ[2], abs=0.001)


def test_what_a_measurement_with_a_predicted_height_adds_is_the_rays(geometry, climbing):
    regions = [seen_at(camera, P_WQ) for camera in geometry.cameras]
    found = geometry.measure_at_height(climbing, regions, np.zeros((2, 2)))
    rays = sum(J.T @ J for J in (projection_jacobian(camera, P_WQ) for camera in geometry.cameras))
    np.testing.assert_allclose(found.independent_covariance(), np.linalg.inv(rays), rtol=0.02)
    known = geometry.measure_at_height(replace(climbing, heights=(0.48, 0.48)), regions, np.zeros((2, 2)))
    np.testing.assert_array_equal(known.independent_covariance(), known.covariance)
