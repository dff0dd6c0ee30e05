"""Calibration of a pair of cameras whose poses are unknown, from pairs of images of one board."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.calibration.camera_calibration import Lens, lens_from_corners, opencv_lists, transform
from drake_tracker.cameras.camera_model import CameraModel


def stereo_from_corners(
    views_left: Sequence[np.ndarray],
    views_right: Sequence[np.ndarray],
    board: Board,
    shape: tuple[int, int],
    shape_right: tuple[int, int] | None = None,
    **options: Any,
) -> tuple[CameraModel, CameraModel, float]:
    """Returns (left, right, rms): two calibrated cameras from the points of one board in pairs of images.

    For cameras at an unknown pose: W is the left camera's own frame and the board's square the unit of length. ``rms``
    is the reprojection error [px] of both cameras together.

    Args:
        views_left: points (n, 2) [px] of the board in the left image of each pair, NaN for hidden points.
        views_right: points (n, 2) [px] in the right images.
        board: the board.
        shape: (h, w) of the left images [px].
        shape_right: (h, w) of the right images [px], if it differs.
        **options: as for `lens_from_corners`.
    """
    shape_right = shape_right or shape
    left = lens_from_corners(views_left, board, shape, **options)
    right = lens_from_corners(views_right, board, shape_right, **options)
    X_RL, rms = relative_pose(left, right, views_left, views_right, board, shape, shape_right)
    return left.camera(shape), right.camera(shape_right, X_RL), rms


def relative_pose(
    left: Lens,
    right: Lens,
    views_left: Sequence[np.ndarray],
    views_right: Sequence[np.ndarray],
    board: Board,
    shape: tuple[int, int],
    shape_right: tuple[int, int],
) -> tuple[np.ndarray, float]:
    """Returns (X_RL, rms): the matrix (4, 4) that takes p_LQ to p_RQ [m], and the reprojection error of both [px].

    Args:
        left: lens of the left camera, from ``views_left``.
        right: lens of the right camera, from ``views_right``.
        views_left: as for `stereo_from_corners`.
        views_right: as for `stereo_from_corners`.
        board: the board.
        shape: (h, w) of the left images [px].
        shape_right: (h, w) of the right images [px].
    """
    common = [np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1) for a, b in zip(views_left, views_right)]
    pairs = [
        [np.where(seen[:, np.newaxis], view, np.nan) for view, seen in zip(views, common)]
        for views in (views_left, views_right)
    ]
    X_RL = right.X_CB[0] @ np.linalg.inv(left.X_CB[0])
    cameras = left.camera(shape), right.camera(shape_right, X_RL)
    if any(camera.is_wide for camera in cameras):
        # OpenCV's function diverges with a rational lens, and wants equally many points in every view of a fisheye.
        return fit_relative_pose(cameras, pairs, board, left.X_CB)
    points, pixels_left = opencv_lists(board, pairs[0])
    _, pixels_right = opencv_lists(board, pairs[1])
    rms, _, _, _, _, R, t, *_ = cv2.stereoCalibrate(
        points,
        pixels_left,
        pixels_right,
        left.K,
        left.distortion,
        right.K,
        right.distortion,
        shape[::-1],
        flags=cv2.CALIB_FIX_INTRINSIC,
    )
    return transform(R, t), rms


def fit_relative_pose(
    cameras: Sequence[CameraModel], pairs: Sequence[Sequence[np.ndarray]], board: Board, X_LB: np.ndarray
) -> tuple[np.ndarray, float]:
    """Returns (X_RL, rms): the pose that best explains the points of a board in pairs of images.

    The sum of squares of all reprojection errors is minimised over X_RL and the board's pose in each pair; the lenses
    are kept.

    Args:
        cameras: the left camera, in its own frame, and the right one, near its pose.
        pairs: for both cameras the points (n, 2) [px] in each image, NaN for hidden points; both cameras have the same
            points.
        board: the board.
        X_LB: near poses of the board in the frame of the left camera, shape (m, 4, 4) [m].

    Returns the matrix (4, 4) that takes p_LQ to p_RQ [m], and the reprojection error of both cameras [px].
    """
    seen = [np.isfinite(view).all(axis=1) for view in pairs[0]]
    which = np.concatenate([np.full(each.sum(), k) for k, each in enumerate(seen)])
    p_BQ = np.concatenate([board.points()[each] for each in seen])
    pixels = [np.concatenate([view[each] for view, each in zip(views, seen)]) for views in pairs]

    def residuals(x: np.ndarray) -> np.ndarray:
        poses = to_matrices(x.reshape(-1, 6))
        X = poses[1:][which]
        p_LQ = np.einsum("nij,nj->ni", X[:, :3, :3], p_BQ) + X[:, :3, 3]
        right = cameras[1].in_frame(cameras[1].X_WC @ poses[0])
        misses = [camera.project(p_LQ) - uv for camera, uv in zip((cameras[0], right), pixels)]
        return np.nan_to_num(np.concatenate(misses, axis=1), nan=1e3).ravel()

    affects = sparsity(which, len(X_LB), residuals=4, shared=6)
    start = to_vectors(np.concatenate([[cameras[1].X_CW], X_LB])).ravel()
    fit = least_squares(residuals, start, jac_sparsity=affects, x_scale="jac")
    rms = float(np.sqrt((fit.fun**2).sum() / (2 * len(which))))
    return to_matrices(fit.x[np.newaxis, :6])[0], rms


def sparsity(which: np.ndarray, views: int, *, residuals: int, shared: int) -> csr_matrix:
    """Returns which residuals depend on which parameters: on the common parameters of all views, and on the pose of
    their own view.

    Args:
        which: the view of each point, shape (n,).
        views: number of views.
        residuals: number of residuals of a point.
        shared: number of parameters that all views share; six for each view follow them.
    """
    own = np.kron(which[:, np.newaxis] == np.arange(views), np.ones((residuals, 6), dtype=bool))
    return csr_matrix(np.hstack([np.ones((len(own), shared), dtype=bool), own]).astype(int))


def to_vectors(X: np.ndarray) -> np.ndarray:
    """Returns poses (m, 4, 4) as rotation vectors and positions, shape (m, 6)."""
    return np.array([np.concatenate([cv2.Rodrigues(each[:3, :3])[0].ravel(), each[:3, 3]]) for each in X])


def to_matrices(vectors: np.ndarray) -> np.ndarray:
    """Returns poses from rotation vectors and positions (m, 6), shape (m, 4, 4)."""
    X = np.tile(np.eye(4), (len(vectors), 1, 1))
    X[:, :3, :3] = [cv2.Rodrigues(each[:3])[0] for each in vectors]
    X[:, :3, 3] = vectors[:, 3:]
    return X
