"""From two centroids to a point: back-projection through calibrated cameras and the intersection of two rays."""

from typing import NamedTuple

import numpy as np

PARALLEL_SINE_SQUARED = 1e-8
"""Rays whose directions make a smaller angle (sine squared) are taken as parallel: they do not fix a depth."""


class RayIntersection(NamedTuple):
    """Midpoint of the common perpendicular of two rays, p_WQ [m] of shape (3,), and its length [m]."""

    p_WQ: np.ndarray
    gap: float


def intersect_rays(ray_left, ray_right):
    """Returns the `RayIntersection` of two rays (origin, unit direction), or None when they do not meet.

    Rays do not meet when they are parallel or when they are closest behind either origin.
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


def triangulate(camera_left, camera_right, uv_left, uv_right):
    """Returns where two cameras see one point, as a `RayIntersection`, or None when the rays do not meet.

    The cameras are `CameraModel`s; ``uv_left`` and ``uv_right`` are (u, v) [px], whole numbers being pixel centres.
    """
    return intersect_rays(_ray(camera_left, uv_left), _ray(camera_right, uv_right))


def _ray(camera, uv):
    origin, directions = camera.rays([uv])
    return origin, directions[0]
