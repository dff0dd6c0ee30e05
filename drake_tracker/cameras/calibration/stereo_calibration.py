"""Calibration of a pair of cameras whose poses are unknown, from pairs of images of one board."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.calibration.camera_calibration import Lens, lens_from_corners, opencv_lists, transform
from drake_tracker.cameras.calibration.relative_pose import fit_relative_pose
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
        views_left: points (n, 2) [px] of the board in the left image of each pair, NaN for hidden ones.
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
