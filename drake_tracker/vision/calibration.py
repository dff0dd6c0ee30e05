"""Camera calibration from images of a chessboard: the lens, and the pose of the camera.

The images may be photographs or rendered. The lens (focal length and distortion) is estimated from views of a board
held at many angles, the pose of the camera from a board that lies at known poses. Each camera is located by itself,
because a chain through the other camera adds the errors of both. `calibration_file` saves the result.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.chessboard import Chessboard, find_corners

MIN_LENS_VIEWS = 3
"""Fewest views of a board from which a lens is calibrated."""


@dataclasses.dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsic parameters, and how well the views determine them.

    Attributes:
        K: (3, 3) intrinsic matrix [px].
        distortion: (5,) coefficients in OpenCV's order.
        rms: reprojection error of the views [px].
        spread: largest angle between two boards [rad]; boards held at similar angles do not determine a lens.
    """

    K: np.ndarray
    distortion: np.ndarray
    rms: float
    spread: float


def calibrate_intrinsics(images: Sequence[np.ndarray], board: Chessboard, **options: Any) -> Lens:
    """Returns the `Lens` of a camera from images of a board held at many angles.

    Images in which the board is not found are skipped.

    Args:
        images: grey images (h, w), uint8.
        board: the chessboard.
        **options: as for `lens_from_corners`.

    Raises DrakeTrackerError when the board is found in fewer than `MIN_LENS_VIEWS` images.
    """
    views = [corners for corners in (find_corners(image, board) for image in images) if corners is not None]
    if len(views) < MIN_LENS_VIEWS:
        raise DrakeTrackerError(
            f"the {board.columns} x {board.rows} board was found in {len(views)} of {len(images)} images; "
            f"a lens needs at least {MIN_LENS_VIEWS}"
        )
    return lens_from_corners(views, board, images[0].shape, **options)


def lens_from_corners(
    views: Sequence[np.ndarray],
    board: Chessboard,
    shape: tuple[int, ...],
    *,
    fix_principal_point: bool = True,
    fix_aspect_ratio: bool = True,
    radial_terms: int = 0,
    tangential: bool = False,
) -> Lens:
    """Returns the `Lens` that best explains the corners of a board in several images.

    By default the principal point stays at the image's centre and the pixels are square: estimated, they are correlated
    with the board's pose, and small images are too coarse to separate them.

    Args:
        views: corners (n, 2) [px] of the board, one array for each image.
        board: the chessboard.
        shape: (h, w) of the images [px].
        fix_principal_point: keep the principal point at the image's centre.
        fix_aspect_ratio: keep both focal lengths equal.
        radial_terms: how many of the coefficients k1, k2, k3 to estimate, 0 to 3.
        tangential: estimate p1 and p2 as well.
    """
    flags = 0
    for fixed, flag in (
        (fix_principal_point, cv2.CALIB_FIX_PRINCIPAL_POINT),
        (fix_aspect_ratio, cv2.CALIB_FIX_ASPECT_RATIO),
        (not tangential, cv2.CALIB_ZERO_TANGENT_DIST),
        (radial_terms < 1, cv2.CALIB_FIX_K1),
        (radial_terms < 2, cv2.CALIB_FIX_K2),
        (radial_terms < 3, cv2.CALIB_FIX_K3),
    ):
        flags |= flag if fixed else 0
    # The aspect ratio that is kept is that of the initial matrix.
    rms, K, distortion, turns, _ = cv2.calibrateCamera(
        *_opencv_lists(board, views), shape[::-1], np.eye(3), np.zeros(5), flags=flags
    )
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    spread = float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())
    return Lens(K, distortion.ravel()[:5], rms, spread)


def locate_camera(
    images: Sequence[np.ndarray], lens: Lens, board: Chessboard, poses: Sequence[np.ndarray]
) -> tuple[np.ndarray, float]:
    """Returns the pose of a camera, from images of a board at known poses.

    Args:
        images: grey images (h, w), uint8.
        lens: of the camera.
        board: the chessboard.
        poses: X_WB (4, 4) of the board [m], one for each image.

    Returns (X_CW, rms): the (4, 4) matrix that takes p_WQ to p_CQ [m] and the reprojection error [px].

    Raises DrakeTrackerError when the board is not found in an image.
    """
    all_pixels, all_points = [], []
    for index, (image, X_WB) in enumerate(zip(images, poses, strict=True)):
        corners = find_corners(image, board)
        if corners is None:
            raise DrakeTrackerError(f"the {board.columns} x {board.rows} board was not found in image {index}")
        all_pixels.append(corners)
        all_points.append(board.corners() @ X_WB[:3, :3].T + X_WB[:3, 3])
    pixels, points = np.concatenate(all_pixels), np.concatenate(all_points)
    _, rotation, translation = cv2.solvePnP(points, pixels, lens.K, lens.distortion, flags=cv2.SOLVEPNP_ITERATIVE)
    miss = cv2.projectPoints(points, rotation, translation, lens.K, lens.distortion)[0][:, 0] - pixels
    return _transform(cv2.Rodrigues(rotation)[0], translation), np.sqrt((miss**2).sum(axis=1).mean())


def stereo_from_corners(
    views_left: Sequence[np.ndarray],
    views_right: Sequence[np.ndarray],
    board: Chessboard,
    shape: tuple[int, int],
    shape_right: tuple[int, int] | None = None,
    **options: Any,
) -> tuple[CameraModel, CameraModel, float]:
    """Returns (left, right, rms): two calibrated cameras from the corners of one board in pairs of images.

    For cameras at an unknown pose: W is the left camera's own frame and the board's square the unit of length. ``rms``
    is the reprojection error [px] of both cameras together.

    Args:
        views_left: corners (n, 2) [px] of the board in the left image of each pair.
        views_right: corners (n, 2) [px] in the right images.
        board: the chessboard.
        shape: (h, w) of the left images [px].
        shape_right: (h, w) of the right images [px], if it differs.
        **options: as for `lens_from_corners`.
    """
    shape_right = shape_right or shape
    left = lens_from_corners(views_left, board, shape, **options)
    right = lens_from_corners(views_right, board, shape_right, **options)
    points, pixels_left = _opencv_lists(board, views_left)
    _, pixels_right = _opencv_lists(board, views_right)
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
    return (
        CameraModel(left.K, left.distortion, np.eye(4), *shape[::-1]),
        CameraModel(right.K, right.distortion, _transform(R, t), *shape_right[::-1]),
        rms,
    )


def board_pose(corners: np.ndarray, camera: CameraModel, board: Chessboard) -> np.ndarray:
    """Returns X_CB (4, 4) [m] of a board from the pixels (n, 2) of its corners in one image of a camera."""
    _, rotation, translation = cv2.solvePnP(board.corners(), corners, camera.K, camera.distortion)
    return _transform(cv2.Rodrigues(rotation)[0], translation)


def _opencv_lists(board: Chessboard, views: Sequence[np.ndarray]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Returns the board's points and the views' pixels, one array for each view, in the types that OpenCV needs."""
    return [board.corners().astype(np.float32)] * len(views), [view.astype(np.float32) for view in views]


def _transform(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = R
    X[:3, 3] = np.ravel(p)
    return X
