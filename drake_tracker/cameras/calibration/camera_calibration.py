"""Camera calibration from images of a board: the lens, and the pose of the camera.

The images may be photographs or rendered. The lens (focal length and distortion) is estimated from views of a board
held at many angles, the pose of the camera from a board that lies at known poses. Each camera is located by itself,
because a chain through the other camera adds the errors of both. `stereo_calibration` calibrates a pair of cameras
whose poses are unknown, and `calibration_file` saves the result.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.boards.chessboard import Chessboard, find_corners
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.lens_models import FISHEYE, PINHOLE
from drake_tracker.core.errors import DrakeTrackerError

MIN_LENS_VIEWS = 3
"""Fewest views of a board from which a lens is calibrated."""
_FISHEYE_FLAGS = ("CALIB_RECOMPUTE_EXTRINSIC", "CALIB_FIX_SKEW")


@dataclasses.dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsic parameters, and how well the views determine them.

    Attributes:
        K: (3, 3) intrinsic matrix [px].
        distortion: coefficients in OpenCV's order, as `CameraModel` has them.
        rms: reprojection error of the views [px].
        spread: largest angle between two boards [rad]; boards held at similar angles do not determine a lens.
        kind: PINHOLE or FISHEYE.
        X_CB: pose of the board in each view, shape (m, 4, 4) [m].
    """

    K: np.ndarray
    distortion: np.ndarray
    rms: float
    spread: float
    kind: str = PINHOLE
    X_CB: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 4, 4)))

    def camera(self, shape: tuple[int, ...], X_CW: np.ndarray | None = None) -> CameraModel:
        """Returns the camera with this lens.

        Args:
            shape: (h, w) of its images [px].
            X_CW: (4, 4) [m]; None for the frame of the camera as the world.
        """
        X_CW = np.eye(4) if X_CW is None else X_CW
        return CameraModel(self.K, self.distortion, X_CW, shape[1], shape[0], self.kind)


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
    board: Board,
    shape: tuple[int, ...],
    *,
    fix_principal_point: bool = True,
    fix_aspect_ratio: bool = True,
    radial_terms: int = 0,
    tangential: bool = False,
    kind: str = PINHOLE,
    rational: bool = False,
) -> Lens:
    """Returns the `Lens` that best explains the corners of a board in several images.

    By default the principal point stays at the image's centre and the pixels are square: estimated, they are correlated
    with the board's pose, and small images are too coarse to separate them.

    Args:
        views: points (n, 2) [px] of the board, one array for each image, NaN for hidden points.
        board: the board.
        shape: (h, w) of the images [px].
        fix_principal_point: keep the principal point at the image's centre.
        fix_aspect_ratio: keep both focal lengths equal.
        radial_terms: how many of the coefficients k1, k2, k3 to estimate, 0 to 3.
        tangential: estimate p1 and p2 as well.
        kind: PINHOLE, or FISHEYE, for which all parameters are estimated.
        rational: estimate k4, k5 and k6 of a pinhole as well.

    Raises DrakeTrackerError when the lens does not fit the views.
    """
    if kind == FISHEYE:
        return _fisheye_from_corners(views, board, shape)
    flags = cv2.CALIB_RATIONAL_MODEL if rational else 0
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
    count = 8 if rational else 5
    try:
        rms, K, distortion, turns, places = cv2.calibrateCamera(
            *opencv_lists(board, views), shape[::-1], np.eye(3), np.zeros(count), flags=flags
        )
    except cv2.error as error:
        raise _does_not_fit("pinhole", views, error) from None
    return _lens(K, distortion.ravel()[:count], rms, PINHOLE, turns, places)


def _fisheye_from_corners(views: Sequence[np.ndarray], board: Board, shape: tuple[int, ...]) -> Lens:
    """Returns the `Lens` of a fisheye, as `lens_from_corners` does."""
    # OpenCV 5 has the flags of its fisheye module in the main module, and wants the points of a view in a row.
    flag = {name: getattr(cv2.fisheye, name, None) or getattr(cv2, name) for name in _FISHEYE_FLAGS}
    points, pixels = opencv_lists(board, views)
    try:
        rms, K, distortion, turns, places = cv2.fisheye.calibrate(
            [each.reshape(1, -1, 3).astype(float) for each in points],
            [each.reshape(1, -1, 2).astype(float) for each in pixels],
            shape[::-1],
            np.eye(3),
            np.zeros((4, 1)),
            flags=sum(flag.values()),
        )
    except cv2.error as error:
        raise _does_not_fit("fisheye", views, error) from None
    return _lens(K, distortion.ravel(), rms, FISHEYE, turns, places)


def _lens(
    K: np.ndarray,
    distortion: np.ndarray,
    rms: float,
    kind: str,
    turns: Sequence[np.ndarray],
    places: Sequence[np.ndarray],
) -> Lens:
    """Returns the `Lens`, given the pose of the board in each view as OpenCV describes it."""
    X_CB = np.array([transform(cv2.Rodrigues(turn)[0], place) for turn, place in zip(turns, places)])
    normals = X_CB[:, :3, 2]
    spread = float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())
    return Lens(K, distortion, rms, spread, kind, X_CB)


def _does_not_fit(kind: str, views: Sequence[np.ndarray], error: cv2.error) -> DrakeTrackerError:
    return DrakeTrackerError(
        f"no {kind} lens fits the board in the {len(views)} images ({str(error.err).strip().rstrip('.')[:80]}); take "
        "photographs of it tilted to all sides and in all parts of the image"
    )


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

    Raises DrakeTrackerError when the board is not found in an image, or looks the same after half a turn.
    """
    if len(board.turns()) > 1:
        raise DrakeTrackerError(f"the {board.name} looks the same after half a turn, and cannot locate a camera")
    all_pixels, all_points = [], []
    for index, (image, X_WB) in enumerate(zip(images, poses, strict=True)):
        corners = find_corners(image, board)
        if corners is None:
            raise DrakeTrackerError(f"the {board.columns} x {board.rows} board was not found in image {index}")
        all_pixels.append(corners)
        all_points.append(board.points() @ X_WB[:3, :3].T + X_WB[:3, 3])
    pixels, points = np.concatenate(all_pixels), np.concatenate(all_points)
    _, rotation, translation = cv2.solvePnP(points, pixels, lens.K, lens.distortion, flags=cv2.SOLVEPNP_ITERATIVE)
    miss = cv2.projectPoints(points, rotation, translation, lens.K, lens.distortion)[0][:, 0] - pixels
    return transform(cv2.Rodrigues(rotation)[0], translation), np.sqrt((miss**2).sum(axis=1).mean())


def board_pose(pixels: np.ndarray, camera: CameraModel, board: Board) -> np.ndarray:
    """Returns X_CB (4, 4) [m] of a board from the pixels (n, 2) of its points in one image, NaN for hidden ones."""
    seen = np.isfinite(pixels).all(axis=1)
    points, pixels = board.points()[seen], pixels[seen]
    K, distortion = camera.K, camera.distortion
    if camera.lens == FISHEYE:  # OpenCV's solver knows pinholes only: give it the image of an ideal one
        rays = camera.in_frame(camera.X_WC).rays(pixels)[1]
        pixels, distortion = camera.focal_lengths * rays[:, :2] / rays[:, 2:] + camera.K[:2, 2], np.zeros(5)
    _, rotation, translation = cv2.solvePnP(points, pixels, K, distortion)
    return transform(cv2.Rodrigues(rotation)[0], translation)


def opencv_lists(board: Board, views: Sequence[np.ndarray]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Returns the board's points and the views' pixels that are seen, one array for each view, as OpenCV needs them."""
    points = board.points().astype(np.float32)
    seen = [np.isfinite(view).all(axis=1) for view in views]
    return [points[each] for each in seen], [view[each].astype(np.float32) for view, each in zip(views, seen)]


def transform(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns the homogeneous matrix (4, 4) of a rotation (3, 3) and a position of three numbers."""
    X = np.eye(4)
    X[:3, :3] = R
    X[:3, 3] = np.ravel(p)
    return X
