"""Tests of points that two cameras locate together, of which one is calibrated wrongly."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.vision.silhouettes.stereo_geometry import StereoGeometry
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
        fit = geometry.measure_at_height(P_WQ, meeting.p_WQ[2], regions, offsets)
        return np.linalg.norm(fit.p_WQ - meeting.p_WQ)

    assert meeting.gap > 0.005
    assert error(offsets) < 0.0005 < 0.002 < error(np.zeros((2, 2)))
