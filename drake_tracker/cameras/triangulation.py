"""From two centroids to a point: back-projection through calibrated cameras and the intersection of two rays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel

PARALLEL_SINE_SQUARED = 1e-8
"""Rays whose directions make a smaller angle (sine squared) are taken as parallel: they do not fix a depth."""


class RayIntersection(NamedTuple):
    """Where two rays meet, or pass each other.

    Attributes:
        p_WQ: midpoint of their common perpendicular, shape (3,) [m].
        gap: length of the common perpendicular [m].
    """

    p_WQ: np.ndarray
    gap: float


def intersect_rays(
    ray_left: tuple[np.ndarray, np.ndarray], ray_right: tuple[np.ndarray, np.ndarray]
) -> RayIntersection | None:
    """Returns the `RayIntersection` of two rays, or None when they do not meet.

    Rays do not meet when they are parallel or when they are closest behind either origin.

    Args:
        ray_left: (origin (3,) [m], unit direction (3,)).
        ray_right: the same.
    """
    (a, d), (b, e) = ray_left, ray_right
    cosine = d @ e
    sine_squared = 1.0 - cosine * cosine
    if sine_squared < PARALLEL_SINE_SQUARED:
        return None
    baseline = b - a
    along_left = (baseline @ d - cosine * (baseline @ e)) / sine_squared
    along_right = (cosine * (baseline @ d) - baseline @ e) / sine_squared
    if along_left <= 0.0 or along_right <= 0.0:
        return None
    nearest_left, nearest_right = a + along_left * d, b + along_right * e
    return RayIntersection((nearest_left + nearest_right) / 2.0, float(np.linalg.norm(nearest_left - nearest_right)))


def triangulate(
    camera_left: CameraModel, camera_right: CameraModel, uv_left: Sequence[float], uv_right: Sequence[float]
) -> RayIntersection | None:
    """Returns where two cameras see one point, as a `RayIntersection`, or None when the rays do not meet.

    Args:
        camera_left: first camera.
        camera_right: second camera.
        uv_left: (u, v) [px] in the first image; whole numbers are pixel centres.
        uv_right: (u, v) [px] in the second image.
    """
    return intersect_rays(camera_left.ray(*uv_left), camera_right.ray(*uv_right))
