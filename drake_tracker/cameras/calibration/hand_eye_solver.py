"""Hand-eye calibration: the pose of a camera on the hand, from images of a chessboard at several poses of the arm."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.calibration.camera_calibration import Lens
from drake_tracker.core.errors import DrakeTrackerError

FEWEST_VIEWS = 3
"""Fewest poses of the arm: two motions of the hand about different axes determine the pose of the camera."""
LEAST_TURN = 0.1
"""Angle between the axes of two motions of the hand below which they count as the same axis [rad]."""


class HandEye(NamedTuple):
    """The result of a hand-eye calibration.

    Attributes:
        X_TC: (4, 4) pose of the camera in the frame of the tool [m].
        X_WB: (4, 4) pose of the board in the world [m].
        rms: reprojection error [px].
    """

    X_TC: np.ndarray
    X_WB: np.ndarray
    rms: float


def solve_hand_eye(X_WTs: Sequence[np.ndarray], views: Sequence[np.ndarray], board: Chessboard, lens: Lens) -> HandEye:
    """Returns the pose of a camera on the hand, and the pose of the board, which does not move and need not be known.

    The closed solution of Park and Martin (1994), from the poses of the board in the single images, is the start of a
    minimisation of the reprojection error of all corners.

    Args:
        X_WTs: (4, 4) pose of the tool in the world at each image [m].
        views: corners (n, 2) [px] of the board in each image.
        board: the chessboard.
        lens: of the camera.

    Raises DrakeTrackerError when there are too few views, or all motions of the hand have the same axis.
    """
    if len(X_WTs) != len(views) or len(views) < FEWEST_VIEWS:
        raise DrakeTrackerError(
            f"hand-eye calibration: {len(views)} views at {len(X_WTs)} poses; at least {FEWEST_VIEWS} are needed"
        )
    corners = board.points()
    X_CBs = []
    for view in views:
        _, turn, p = cv2.solvePnP(corners, view, lens.K, lens.distortion)
        X_CBs.append(_pose(Rotation.from_rotvec(turn.ravel()), p.ravel()))
    X_TC = park_martin(X_WTs, X_CBs)
    X_WB = X_WTs[0] @ X_TC @ X_CBs[0]
    poses = np.array(X_WTs)

    def miss(numbers: np.ndarray) -> np.ndarray:
        X_TC, X_WB = _unpack(numbers[:6]), _unpack(numbers[6:])
        errors = []
        for X_WT, view in zip(poses, views):
            X_CB = np.linalg.inv(X_WT @ X_TC) @ X_WB
            turn = Rotation.from_matrix(X_CB[:3, :3]).as_rotvec()
            errors.append(cv2.projectPoints(corners, turn, X_CB[:3, 3], lens.K, lens.distortion)[0][:, 0] - view)
        return np.concatenate(errors).ravel()

    found = least_squares(miss, np.concatenate([_pack(X_TC), _pack(X_WB)]), x_scale="jac", method="lm")
    rms = float(np.sqrt(2.0 * np.mean(found.fun**2)))
    return HandEye(_unpack(found.x[:6]), _unpack(found.x[6:]), rms)


def park_martin(X_WTs: Sequence[np.ndarray], X_CBs: Sequence[np.ndarray]) -> np.ndarray:
    """Returns X_TC (4, 4), the least-squares solution of A X = X B (Park and Martin 1994).

    A is a motion of the tool and B the motion of the camera that belongs to it; all pairs of poses are used.

    Args:
        X_WTs: (4, 4) poses of the tool in the world.
        X_CBs: (4, 4) poses of the board relative to the camera, of the same images.

    Raises DrakeTrackerError when all motions of the hand have the same axis.
    """
    motions = []
    for i, j in itertools.combinations(range(len(X_WTs)), 2):
        A = np.linalg.inv(X_WTs[j]) @ X_WTs[i]
        B = X_CBs[j] @ np.linalg.inv(X_CBs[i])
        motions.append((A, B))
    alphas = np.array([Rotation.from_matrix(A[:3, :3]).as_rotvec() for A, _ in motions])
    betas = np.array([Rotation.from_matrix(B[:3, :3]).as_rotvec() for _, B in motions])
    if np.linalg.svd(alphas, compute_uv=False)[1] < LEAST_TURN:
        raise DrakeTrackerError("hand-eye calibration: the hand must turn about at least two axes between the images")
    R_TC, _ = Rotation.align_vectors(alphas, betas)
    R = R_TC.as_matrix()
    left = np.concatenate([A[:3, :3] - np.eye(3) for A, _ in motions])
    right = np.concatenate([R @ B[:3, 3] - A[:3, 3] for A, B in motions])
    return _pose(R_TC, np.linalg.lstsq(left, right, rcond=None)[0])


def _pose(R: Rotation, p: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R.as_matrix(), p
    return X


def _pack(X: np.ndarray) -> np.ndarray:
    return np.concatenate([Rotation.from_matrix(X[:3, :3]).as_rotvec(), X[:3, 3]])


def _unpack(numbers: np.ndarray) -> np.ndarray:
    return _pose(Rotation.from_rotvec(numbers[:3]), numbers[3:])
