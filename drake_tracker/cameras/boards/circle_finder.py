"""Finds dark circles on a bright board in an image (Nashman and Chaconas 1990, section 3).

In the paper an operator puts a window around each circle, the image is thresholded, and the first moments of the dark
pixels give the centroid; of ten measurements the one with the largest area is used (`measure_circle`,
`best_measurement`). `find_circles` needs neither operator nor threshold and weights pixels by their darkness, which is
several times more accurate: a circle of 9 px has half of its pixels on its rim.

Pixel coordinates follow OpenCV: (0, 0) is the centre of the top left pixel, u runs to the right, v down.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.errors import DrakeTrackerError

MIN_AREA = 12
"""Area of the smallest circle searched for [px]."""
MIN_CONTRAST = 20.0
"""Least difference between a circle and its surroundings [grey]."""
_BLOCK_SHARE = 0.2
"""Side of the block over which the local threshold is computed, as a fraction of the image's shortest side."""
_MAX_AREA_SHARE = 0.02
"""Area of the largest circle searched for, as a fraction of the image's area."""
_MAX_AXIS_RATIO = 4.0
"""Largest ratio of an ellipse's axes."""
_MAX_REACH = 5.3
"""Largest squared distance of a pixel from the centre, in variances: 4 in an ellipse, 6 in a square."""
_EDGE_DARKNESS = 0.25
"""Pixels that are darker than the board by this fraction of the contrast belong to a circle."""
_MARGIN = 4
"""Width of the border around a circle that is examined [px]."""
_MIN_BRIGHT_RING = 0.6
"""Least fraction of the ring around a circle that must show the plain board; the rest may lie beyond its edge."""
_MAX_RING_SPREAD = 0.1
"""Largest standard deviation of the board around a circle, as a fraction of the contrast."""


class CircleMeasurement(NamedTuple):
    """A circle in one image.

    Attributes:
        u: column of the centroid [px].
        v: row of the centroid [px].
        area: of the circle's image [px].
    """

    u: float
    v: float
    area: float


def measure_circle(image: np.ndarray, window: Sequence[float], threshold: float) -> CircleMeasurement:
    """Returns the `CircleMeasurement` of the dark pixels in an operator's window.

    The centroid is the sum of the dark pixels' addresses (accumulative histogram) divided by their number (frequency
    histogram); the text prints the division upside down.

    Args:
        image: grey uint8 (h, w).
        window: rectangle (u0, v0, width, height) [px] that contains one circle; dark areas that its border cuts are
            ignored.
        threshold: pixels that are not brighter than this [grey] are dark.

    Raises DrakeTrackerError when the window is not inside the image, or contains no whole circle or more than one.
    """
    u0, v0, width, height = (int(value) for value in window)
    where = f"the window {width} x {height} px at ({u0}, {v0})"
    if min(u0, v0) < 0 or min(width, height) < 1 or u0 + width > image.shape[1] or v0 + height > image.shape[0]:
        raise DrakeTrackerError(f"{where} is not inside the image of {image.shape[1]} x {image.shape[0]} px")
    dark = cv2.compare(np.ascontiguousarray(image[v0 : v0 + height, u0 : u0 + width]), float(threshold), cv2.CMP_LE)
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(dark, connectivity=8)
    left, top, w, h, area = statistics.T
    whole = (left > 0) & (top > 0) & (left + w < width) & (top + h < height) & (area >= MIN_AREA)
    whole[0] = False
    circles = np.flatnonzero(whole)
    if len(circles) == 0:
        raise DrakeTrackerError(
            f"{where} contains no whole circle darker than {threshold:g}; move or enlarge it, or raise the threshold"
        )
    if len(circles) > 1:
        raise DrakeTrackerError(
            f"{where} contains {len(circles)} dark areas; it must contain one circle: make it smaller"
        )
    moments = cv2.moments((labels == circles[0]).view(np.uint8), binaryImage=True)
    area = moments["m00"]
    return CircleMeasurement(u0 + moments["m10"] / area, v0 + moments["m01"] / area, area)


def best_measurement(measurements: Sequence[CircleMeasurement]) -> CircleMeasurement:
    """Returns the measurement with the largest area, as the paper does with ten: pixels near the threshold flicker."""
    return max(measurements, key=lambda measurement: measurement.area)


def find_circles(images: ArrayLike, count: int = 4) -> list[CircleMeasurement]:
    """Returns a `CircleMeasurement` of everything that looks like a dark circle in an image, the largest first.

    Small dark objects (the pegs on the board) look like circles too; `circle_pose.locate_board` finds the circles of
    the board among the candidates.

    Args:
        images: grey image (h, w), or several of one scene (n, h, w), which are averaged first.
        count: least number of circles.

    Raises DrakeTrackerError when fewer are found.
    """
    image = np.asarray(images, dtype=np.float32)
    if image.ndim == 3:
        image = image.mean(axis=0)
    found = sorted(_candidates(image), key=lambda measurement: -measurement.area)
    if len(found) < count:
        raise DrakeTrackerError(
            f"found {len(found)} of {count} dark circles; one may be hidden or out of view: clear the view, or "
            "move the camera until it sees the whole board"
        )
    return found


def _candidates(image: np.ndarray) -> list[CircleMeasurement]:
    """Returns everything that looks like a dark circle in a float32 image (h, w)."""
    grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    block = max(11, int(_BLOCK_SHARE * min(grey.shape))) | 1
    method = cv2.ADAPTIVE_THRESH_MEAN_C
    dark = cv2.adaptiveThreshold(grey, 255, method, cv2.THRESH_BINARY_INV, block, MIN_CONTRAST / 2)
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(dark, connectivity=4)
    found = []
    for label in range(1, count):
        left, top, width, height, area = statistics[label]
        margin = _MARGIN
        inside = (
            left >= margin
            and top >= margin
            and left + width + margin <= grey.shape[1]
            and top + height + margin <= grey.shape[0]
        )
        if not inside or not MIN_AREA <= area <= _MAX_AREA_SHARE * grey.size:
            continue
        patch = np.s_[top - margin : top + height + margin, left - margin : left + width + margin]
        blob = (labels[patch] == label).view(np.uint8)
        if _is_elliptic(blob):
            measurement = _weighted(image[patch], blob, left - margin, top - margin)
            if measurement is not None:
                found.append(measurement)
    return found


def _is_elliptic(blob: np.ndarray) -> bool:
    """Returns whether the white pixels of a mask approximately fill an ellipse that is not too thin."""
    v, u = np.nonzero(blob)
    points = np.column_stack([u, v]).astype(float)
    points -= points.mean(axis=0)
    covariance = points.T @ points / len(points) + np.eye(2) / 12.0
    axes = np.linalg.eigvalsh(covariance)
    if axes[1] > _MAX_AXIS_RATIO**2 * axes[0]:
        return False
    reach = np.einsum("ni,ij,nj->n", points, np.linalg.inv(covariance), points).max()
    full = len(points) / (4.0 * np.pi * np.sqrt(axes[0] * axes[1]))
    return bool(reach <= _MAX_REACH and 0.85 < full < 1.1)


def _weighted(patch: np.ndarray, blob: np.ndarray, u0: int, v0: int) -> CircleMeasurement | None:
    """Returns the measurement of a blob with its pixels weighted by darkness, or None when no plain board surrounds it.

    The board's brightness is a plane fitted to the ring around the blob, so that uneven light does not shift the
    centroid. The rim is kept narrow, because the board's edge may be two pixels away.

    Args:
        patch: part of the image around the blob, float32 (h, w).
        blob: mask of the blob, uint8 (h, w).
        u0: column of the patch in the image [px].
        v0: row of the patch in the image [px].
    """
    neighbours = np.ones((3, 3), np.uint8)
    ring = cv2.dilate(blob, neighbours, iterations=2) - blob > 0
    bright = np.percentile(patch[ring], 75)
    contrast = bright - np.percentile(patch[blob > 0], 25)
    if contrast < MIN_CONTRAST:
        return None
    near = cv2.dilate(blob, neighbours)
    blob = (patch < bright - _EDGE_DARKNESS * contrast).view(np.uint8) & near
    rim = cv2.dilate(blob, neighbours)
    ring = cv2.dilate(rim, neighbours) - rim > 0
    even = ring & (np.abs(patch - bright) < _EDGE_DARKNESS * contrast)
    if np.count_nonzero(even) < _MIN_BRIGHT_RING * np.count_nonzero(ring):
        return None
    v, u = np.mgrid[: patch.shape[0], : patch.shape[1]]
    plane = np.stack([np.ones_like(u), u, v], axis=-1).astype(float)
    coefficients = np.linalg.lstsq(plane[even], patch[even].astype(float), rcond=None)[0]
    darkness = plane @ coefficients - patch
    if darkness[even].std() > _MAX_RING_SPREAD * contrast:
        return None
    weights = np.where(rim > 0, darkness, 0.0)
    total = weights.sum()
    return CircleMeasurement(
        u0 + float((weights * u).sum() / total), v0 + float((weights * v).sum() / total), float(total / contrast)
    )
