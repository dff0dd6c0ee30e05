"""The one camera that watches the board, placed at random so that the whole face is in view."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.ball.ball_board import CIRCLE_RADIUS, CIRCLES, face_corners
from drake_tracker.world.ball.ball_board_visual import WALL_HEIGHT
from drake_tracker.world.config import BoardCameraConfig, BoardConfig
from drake_tracker.world.imaging.cameras import camera_pose, true_camera_model

NAME = "camera"
MARGIN = 4.0
"""Least distance of the board's corners from the edges of the image [px]."""
_STREAM = 35
_TRIES = 1000


def draw_camera_pose(
    config: BoardCameraConfig, *, board: BoardConfig, X_WB: RigidTransform, seed: int
) -> RigidTransform:
    """Returns X_WC of the camera, drawn from the seed until the camera sees the whole face of the board.

    Section 3: "the only constraint on its placement is that the entire face of the board must be in the field of view".
    In addition no wall may hide a circle; the board of the paper may not have had walls.

    Args:
        config: image size, field of view, and the ranges of distance, azimuth, elevation and roll.
        board: its size, and whether it has walls.
        X_WB: pose of the board.
        seed: of the random draws.

    Raises DrakeTrackerError when none of 1000 poses will do.
    """
    rng = np.random.default_rng([seed, _STREAM])
    corners = face_corners(board)
    look_at = X_WB @ corners.mean(axis=0)
    low, high = config.elevation_range_deg
    near, far = config.distance_range
    for _ in range(_TRIES):
        azimuth_deg = rng.uniform(-config.azimuth_range_deg, config.azimuth_range_deg)
        elevation_deg, distance = rng.uniform(low, high), rng.uniform(near, far)
        roll = np.deg2rad(rng.uniform(-config.roll_range_deg, config.roll_range_deg))
        X_WC = camera_pose(azimuth_deg, elevation_deg, distance, look_at)
        X_WC = X_WC @ RigidTransform(RotationMatrix.MakeZRotation(roll), np.zeros(3))
        over_the_walls = not board.walls or clears_walls(X_WB.inverse() @ X_WC.translation(), board)
        if over_the_walls and in_view(true_camera_model(config, X_WC), X_WB.multiply(corners.T).T):
            return X_WC
    raise DrakeTrackerError(
        f"camera: none of {_TRIES} random camera poses has the whole board in view; widen camera.fov_deg "
        f"({config.fov_deg:g}) or camera.distance_range"
    )


def in_view(camera: CameraModel, points: np.ndarray) -> bool:
    """Returns whether points (n, 3) [m, W] lie in the image of a camera, at least `MARGIN` from its edges."""
    pixels = camera.project(points)
    size = np.array([camera.width, camera.height])
    return bool(np.all(pixels >= MARGIN) and np.all(pixels <= size - 1 - MARGIN))


def clears_walls(p_BC: np.ndarray, board: BoardConfig) -> bool:
    """Returns whether a camera at p_BC [m] sees all four circles over the walls along the board's sides."""
    for side in (-1.0, 1.0):
        beyond = side * p_BC[0] - 0.5 * board.width
        to_wall = 0.5 * board.width - (max(abs(x) for x, _ in CIRCLES) + CIRCLE_RADIUS)
        if beyond > 0.0 and p_BC[2] * to_wall / (to_wall + beyond) < WALL_HEIGHT:
            return False
    return True
