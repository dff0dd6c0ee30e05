"""Corners of a board, refined in a frontal picture of it.

Seen at a slant, the squares of a board are so short that an upright window round a corner contains others.
"""

import cv2
import numpy as np


def frontal_homography(found: np.ndarray, frontal: np.ndarray) -> np.ndarray | None:
    """Returns H (3, 3) from the image to the frontal picture, or None when the points do not determine it.

    Args:
        found: pixels of the corners in the image (n, 2).
        frontal: where they are in the frontal picture (n, 2) [px].
    """
    return cv2.findHomography(found, frontal)[0]


def refine_corners(
    image: np.ndarray,
    found: np.ndarray,
    H: np.ndarray,
    size: tuple[int, int],
    window: int,
    stop: tuple[int, int, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the refined pixels (n, 2) in the image, and the frontal picture.

    Each corner starts where it was found, not on the regular grid: the lens's distortion makes them differ. A corner
    that lies outside the picture stays as it is.

    Args:
        image: grey image (h, w).
        found: pixels of the corners in it (n, 2).
        H: see `frontal_homography`.
        size: width and height of the frontal picture [px].
        window: half the width of the window round a corner in it [px].
        stop: criterion of cv2.cornerSubPix.
    """
    picture = cv2.warpPerspective(image, H, size, borderMode=cv2.BORDER_REPLICATE)
    start = cv2.perspectiveTransform(found[:, np.newaxis].astype(float), H).astype(np.float32)
    inside = ((start >= 0.0) & (start < size)).all(axis=(1, 2))
    refined = found.astype(float)
    if inside.any():
        corners = cv2.cornerSubPix(picture, start[inside], (window, window), (-1, -1), stop)
        refined[inside] = cv2.perspectiveTransform(corners.reshape(-1, 1, 2).astype(float), np.linalg.inv(H))[:, 0]
    return refined, picture
