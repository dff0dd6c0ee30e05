import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.calibration.camera_calibration import Lens
from drake_tracker.cameras.calibration.hand_eye_solver import park_martin, solve_hand_eye
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError

BOARD = Chessboard(7, 4, 0.028)
LENS = Lens(np.array([[110.0, 0.0, 63.5], [0.0, 110.0, 63.5], [0.0, 0.0, 1.0]]), np.zeros(5), 0.0, 0.0)


def pose(rotvec, p):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.from_rotvec(rotvec).as_matrix(), p
    return X


X_TC = pose([0.1, -0.25, 1.5], [0.06, 0.01, -0.1])
X_WB = pose([np.pi - 0.02, 0.0, 0.3], [0.5, 0.1, 0.45])


def views(count, noise=0.0, seed=0, axes=3):
    """Poses of the tool from which a camera sees the board, and the corners in its images."""
    rng = np.random.default_rng(seed)
    X_WTs, corners = [], []
    middle = BOARD.points().mean(axis=0)
    for _ in range(count):
        turn = np.zeros(3)
        turn[3 - axes :] = rng.uniform(-0.4, 0.4, axes)
        X_BC = pose([0.0, 0.0, 0.0], middle - [*rng.uniform(-0.02, 0.02, 2), rng.uniform(0.25, 0.35)]) @ pose(
            turn, np.zeros(3)
        )
        X_WC = X_WB @ X_BC
        uv = CameraModel(LENS.K, LENS.distortion, np.linalg.inv(X_WC), 128, 128).project(
            BOARD.points() @ X_WB[:3, :3].T + X_WB[:3, 3]
        )
        X_WTs.append(X_WC @ np.linalg.inv(X_TC))
        corners.append(uv + rng.normal(0.0, noise, uv.shape))
    return X_WTs, corners


def test_a_known_pose_is_recovered():
    found = solve_hand_eye(*views(8), BOARD, LENS)
    assert pytest.approx(X_TC, abs=1e-5) == found.X_TC
    assert pytest.approx(X_WB, abs=1e-5) == found.X_WB
    assert found.rms < 1e-3


def test_noise_of_the_corners_moves_it_little():
    found = solve_hand_eye(*views(20, noise=0.15), BOARD, LENS)
    assert found.X_TC[:3, 3] == pytest.approx(X_TC[:3, 3], abs=0.001)
    assert found.rms == pytest.approx(0.15 * np.sqrt(2.0), rel=0.1)


def test_the_closed_solution_is_exact_without_noise():
    X_WTs, _ = views(4)
    X_CBs = [np.linalg.inv(X_WT @ X_TC) @ X_WB for X_WT in X_WTs]
    assert park_martin(X_WTs, X_CBs) == pytest.approx(X_TC, abs=1e-9)


def test_motions_about_one_axis_do_not_suffice():
    X_WTs, corners = views(6, axes=1)
    with pytest.raises(DrakeTrackerError, match="two axes"):
        solve_hand_eye(X_WTs, corners, BOARD, LENS)


def test_two_views_do_not_suffice():
    X_WTs, corners = views(2)
    with pytest.raises(DrakeTrackerError, match="at least 3"):
        solve_hand_eye(X_WTs, corners, BOARD, LENS)
