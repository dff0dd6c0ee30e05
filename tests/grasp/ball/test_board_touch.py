import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.grasp.ball.board_touch import MAX_MISFIT, board_pose_from_touches

MARKS = np.array([[-0.20, 0.12], [0.20, 0.12], [0.0, 0.30]])
RADIUS = 0.004
UP_SLOPE = RotationMatrix.MakeYRotation(-np.deg2rad(10.0)) @ RotationMatrix.MakeZRotation(-np.pi / 2)
X_WB = RigidTransform(RollPitchYaw(0.02, 0.01, 0.03).ToRotationMatrix() @ UP_SLOPE, [0.557, -0.006, 0.50])


def touched(marks=MARKS, X_WB=X_WB):
    """Where the probe's centre is when its tip touches the marks."""
    return np.array([X_WB @ np.array([*mark, RADIUS]) for mark in marks])


def error(found, X_WB=X_WB):
    E = X_WB.inverse() @ found
    return E.translation(), E.rotation().ToAngleAxis().angle()


def test_the_example_has_the_frame_of_the_board():
    slope = np.deg2rad(10.0)
    np.testing.assert_allclose(UP_SLOPE.matrix()[:, 1], [np.cos(slope), 0.0, np.sin(slope)], atol=1e-12)
    np.testing.assert_allclose(UP_SLOPE.matrix()[:, 0], [0.0, -1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 1, 0], [1, 2, 0]])
def test_exact_touches_give_the_exact_pose_in_any_order(order):
    found = board_pose_from_touches(touched(MARKS[order]), MARKS[order], RADIUS)
    assert found.IsNearlyEqualTo(X_WB, 1e-12)


def test_a_flat_and_a_turned_board_are_found():
    for yaw in (0.0, 1.0, -2.5, np.pi):
        X = RigidTransform(RollPitchYaw(0.0, 0.0, yaw).ToRotationMatrix(), [0.1, 0.2, 0.3])
        assert board_pose_from_touches(touched(X_WB=X), MARKS, RADIUS).IsNearlyEqualTo(X, 1e-12)


def test_the_errors_in_the_plane_are_those_of_the_placement():
    rng = np.random.default_rng(4)
    centre = np.array([*MARKS.mean(axis=0), 0.0])
    rows = []
    for _ in range(400):
        found = board_pose_from_touches(touched(MARKS + 0.0005 * rng.standard_normal(MARKS.shape)), MARKS, RADIUS)
        E = X_WB.inverse() @ found
        rows.append([*(E @ centre - centre), E.rotation().ToRollPitchYaw().yaw_angle()])
    x, y, z, turn = np.std(rows, axis=0)
    np.testing.assert_allclose([x, y], 0.0005 / np.sqrt(3.0), rtol=0.12)
    assert turn == pytest.approx(0.0005 / np.linalg.norm(MARKS - MARKS.mean(axis=0)), rel=0.12)
    assert z < 1e-9  # a mark missed within the plane is still on the plane


def test_errors_across_the_plane_tilt_it_as_the_docstring_says():
    rng = np.random.default_rng(5)
    tilts = []
    for _ in range(400):
        points = touched() + 1e-4 * rng.standard_normal((3, 1)) * X_WB.rotation().matrix()[:, 2]
        E = X_WB.inverse() @ board_pose_from_touches(points, MARKS, RADIUS)
        tilts.append([E.rotation().ToRollPitchYaw().roll_angle(), E.rotation().ToRollPitchYaw().pitch_angle()])
    expected = 1e-4 * np.array([np.sqrt(1.5) / 0.18, 1.0 / (np.sqrt(2.0) * 0.20)])
    np.testing.assert_allclose(np.std(tilts, axis=0), expected, rtol=0.12)


def test_points_on_a_line_are_refused():
    marks = np.array([[-0.20, 0.12], [0.20, 0.12], [0.0, 0.122]])
    with pytest.raises(DrakeTrackerError, match="nearly collinear"):
        board_pose_from_touches(touched(marks), marks, RADIUS)


def test_points_that_are_not_the_marks_are_refused():
    shifted = MARKS + [[0.0, 0.0], [MAX_MISFIT + 0.002, 0.0], [0.0, 0.0]]
    with pytest.raises(DrakeTrackerError, match="up to 12 mm from those of the marks"):
        board_pose_from_touches(touched(shifted), MARKS, RADIUS)
    with pytest.raises(DrakeTrackerError, match="right order"):
        board_pose_from_touches(touched(MARKS[[0, 2, 1]]), MARKS, RADIUS)
