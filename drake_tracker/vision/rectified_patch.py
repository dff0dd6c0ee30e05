"""Shows a horizontal plane in a camera's image as seen from above.

The patch may move and turn with an object. There the object keeps its size and its direction, whatever the height of
the camera.
"""

import math

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel

CELL = 0.002
"""Side of a cell of a rectified patch [m]: a little less than a pixel on the table in hover."""


def rotation(angle: float) -> np.ndarray:
    """Returns the matrix (2, 2) that turns vectors by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def plane_homography(camera: CameraModel, origin: np.ndarray, yaw: float) -> np.ndarray:
    """Returns the matrix (3, 3) that takes points (x, y, 1) [m] of a horizontal plane to pixels, without distortion.

    Args:
        camera: the camera at the capture of the image.
        origin: of the plane's coordinates, shape (3,) [m, W].
        yaw: angle of their x axis about z_W [rad].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    X_WP = np.array([[c, -s, origin[0]], [s, c, origin[1]], [0.0, 0.0, origin[2]], [0.0, 0.0, 1.0]])
    return camera.K @ camera.X_CW[:3] @ X_WP


def rectified(
    image: np.ndarray, seen: np.ndarray, camera: CameraModel, origin: np.ndarray, yaw: float, half: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns a patch of a horizontal plane and which of its cells are seen, both float32 of one shape.

    Args:
        image: grey, float32, without distortion.
        seen: float32, 1 where the image shows the scene and 0 where it shows the hand.
        camera: the camera at the capture.
        origin: middle of the patch, shape (3,) [m, W].
        yaw: angle of the patch's columns about z_W [rad].
        half: half the extent of the patch along and across [m].
    """
    columns, rows = (2 * round(extent / CELL) + 1 for extent in half)
    cells = np.array([[CELL, 0.0, -half[0]], [0.0, CELL, -half[1]], [0.0, 0.0, 1.0]])
    H = plane_homography(camera, origin, yaw) @ cells
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    patch = cv2.warpPerspective(_softened(image, camera, origin), H, (columns, rows), flags=flags)
    mask = cv2.warpPerspective(seen, H, (columns, rows), flags=flags)
    ends = np.array([[0.0, 0.0, 1.0], [columns, 0.0, 1.0], [0.0, rows, 1.0], [columns, rows, 1.0]]) @ H[2]
    if ends.min() <= 0.0:  # part of the patch is behind the camera
        mask = np.zeros_like(mask)
    return patch, (mask > 0.99).astype(np.float32)


def _softened(image: np.ndarray, camera: CameraModel, origin: np.ndarray) -> np.ndarray:
    """Returns an image that is smoothed so that a cell averages the pixels in it."""
    depth = float(camera.X_CW[2, :3] @ origin + camera.X_CW[2, 3])
    pixels = CELL * camera.K[0, 0] / max(depth, CELL)
    return cv2.GaussianBlur(image, (0, 0), 0.5 * pixels) if pixels > 1.0 else image
