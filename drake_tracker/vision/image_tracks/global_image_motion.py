"""Motion of the whole image between images of one camera: a hand-held camera, a shake, a pan.

`camera_motion` aligns images with a picture of the empty scene, which must be known. Here the images that a motion
detector compares are aligned with each other, so that a camera may move without end.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

LARGEST_SIDE = 640
"""Longer side above which an image is used at lower resolution [px]."""
FEATURES = 200
"""Number of corners whose motion is measured."""
LEAST_FEATURES = 12
"""Least number of corners that must move alike."""
LEAST_AGREEMENT = 0.5
"""Least share of the corners that must move alike."""
TOLERANCE = 0.7
"""Distance within which corners move alike [px]."""
TILES = (32, 24)
"""Columns and rows of tiles, the share of which with motion suggests that the whole image moves."""
TILE_SHARE = 0.12
"""See there."""
STEP = 4
"""Spacing of the pixels that `shift_estimate` uses, along each axis."""
SAMPLES = 1024
"""Number of those pixels from which their usual change is taken."""
STILL = 0.1
"""Displacement below which the image counts as still [px]."""


class GlobalImageMotion(NamedTuple):
    """How the whole image moves.

    Attributes:
        transform: (2, 3), from pixels of the reference to those of the image.
        displacement: root mean square displacement of the corners of the scene [px].
    """

    transform: np.ndarray
    displacement: float


def suggests_shift(mask: np.ndarray) -> bool:
    """Returns whether moving pixels are so widespread that the whole image may have moved.

    Args:
        mask: uint8 (h, w), 255 where something moves.
    """
    u0, v0, width, height = cv2.boundingRect(mask)
    across, down = (tiles / size for tiles, size in zip(TILES, reversed(mask.shape)))
    columns = math.ceil((u0 + width) * across) - math.floor(u0 * across)
    rows = math.ceil((v0 + height) * down) - math.floor(v0 * down)
    least = TILE_SHARE * TILES[0] * TILES[1]
    if columns * rows <= least:
        return False
    return cv2.countNonZero(cv2.resize(mask, TILES, interpolation=cv2.INTER_AREA)) > least


def shift_estimate(before: np.ndarray, after: np.ndarray) -> float:
    """Returns how far the whole image may have moved [px].

    It takes one step of Lucas and Kanade's method on every 16th pixel. It costs little, and is right up to about a
    pixel; larger values mean no more than that the image has moved. Pixels that change much more than most show
    objects and do not count.

    Args:
        before: grey image (h, w) of any type.
        after: a later one.
    """
    if min(before.shape) < STEP + 4:
        return 0.0

    def sampled(image: np.ndarray, du: int, dv: int) -> np.ndarray:
        """Returns pixels to the right of and below those used, as a row."""
        height, width = image.shape
        pixels = image[2 + dv : height - 2 + dv : STEP, 2 + du : width - 2 + du : STEP]
        return pixels.astype(np.float32).ravel()

    change = sampled(after, 0, 0) - sampled(before, 0, 0)
    slope_u = sampled(before, 1, 0) - sampled(before, -1, 0)
    slope_v = sampled(before, 0, 1) - sampled(before, 0, -1)
    size = np.abs(change)
    usual = size <= 4.0 * np.median(size[:: max(1, size.size // SAMPLES) | 1]) + 1e-3
    half = np.float32(0.5) * usual
    slope_u *= half
    slope_v *= half
    uu, uv, vv = (float(a @ b) for a, b in ((slope_u, slope_u), (slope_u, slope_v), (slope_v, slope_v)))
    ut, vt = float(slope_u @ change), float(slope_v @ change)
    least = 0.5 * (uu + vv - math.hypot(uu - vv, 2.0 * uv))  # the smaller eigenvalue of the normal equations
    if least <= 1e-6 * np.count_nonzero(usual):
        return 0.0
    return math.hypot(vv * ut - uv * vt, uu * vt - uv * ut) / (uu * vv - uv**2)


def find_shifts(reference: np.ndarray, images: Sequence[np.ndarray]) -> list[GlobalImageMotion] | None:
    """Returns the motion of the scene from one image to others, None when no common motion is found.

    Corners are followed with the pyramidal method of Lucas and Kanade (Bouguet 2000). A similarity transform is fitted
    to most corners (RANSAC), so that moving objects do not count.

    Args:
        reference: grey uint8 (h, w).
        images: others of the same shape.
    """
    factor = max(1.0, max(reference.shape) / LARGEST_SIDE)
    if factor > 1.0:
        size = (round(reference.shape[1] / factor), round(reference.shape[0] / factor))
        reference = cv2.resize(reference, size, interpolation=cv2.INTER_AREA)
        images = [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in images]
    corners = cv2.goodFeaturesToTrack(reference, FEATURES, 0.02, max(reference.shape) / 40)
    if corners is None or len(corners) < LEAST_FEATURES:
        return None
    found = []
    for image in images:
        moved, status, _ = cv2.calcOpticalFlowPyrLK(reference, image, corners, None, winSize=(21, 21), maxLevel=3)
        good = status.ravel() > 0
        before, after = corners.reshape(-1, 2)[good], moved.reshape(-1, 2)[good]
        if len(before) < LEAST_FEATURES:
            return None
        transform, inliers = cv2.estimateAffinePartial2D(before, after, ransacReprojThreshold=TOLERANCE)
        if transform is None or inliers.sum() < max(LEAST_FEATURES, LEAST_AGREEMENT * len(before)):
            return None
        shift = before @ (transform[:, :2] - np.eye(2)).T + transform[:, 2]
        transform[:, 2] *= factor
        transform[:, 2] += 0.5 * (factor - 1.0) * (np.ones(2) - transform[:, :2].sum(axis=1))
        found.append(GlobalImageMotion(transform, factor * float(np.sqrt(np.mean(np.sum(shift**2, axis=1))))))
    return found


def align_to(image: np.ndarray, shift: GlobalImageMotion) -> np.ndarray:
    """Returns an image as it would look without the motion of the scene; the border is repeated.

    Args:
        image: of any type that OpenCV interpolates, shape (h, w).
        shift: from the reference to it.
    """
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(image, shift.transform, image.shape[::-1], flags=flags, borderMode=cv2.BORDER_REPLICATE)


def clear_border(mask: np.ndarray, displacement: float) -> np.ndarray:
    """Returns a mask without its border, which not all aligned images show.

    Args:
        mask: uint8 (h, w).
        displacement: largest one between the images [px].
    """
    margin = min(math.ceil(displacement) + 3, min(mask.shape) // 3)
    cleared = np.zeros_like(mask)
    inner = np.s_[margin:-margin, margin:-margin]
    cleared[inner] = mask[inner]
    return cleared
