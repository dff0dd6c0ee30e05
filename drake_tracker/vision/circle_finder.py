"""Dark circles on a bright board: where an image shows them (Nashman and Chaconas 1990, section 3).

The paper's way: an operator puts a window around each circle, the image is thresholded, and the first moments of the
dark pixels give the centroid; of ten readings the one with the largest area counts (`read_window`, `best_reading`).
`find_circles` needs no operator and no threshold, and weighs pixels by their darkness, which is several times more
exact: a circle of 9 px has half of its pixels on its rim.

Pixel coordinates follow OpenCV: (0, 0) is the centre of the top left pixel, u runs to the right, v down.
"""

from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

MIN_AREA = 12
"""Pixels of the smallest circle looked for."""
MIN_CONTRAST = 20.0
"""Least difference between a circle and what surrounds it [grey]."""
_BLOCK_SHARE = 0.2
"""Side of the block over which the local threshold is taken, in shortest sides of the image."""
_MAX_AREA_SHARE = 0.02
"""Largest circle looked for, in areas of the image."""
_MAX_AXIS_RATIO = 4.0
_MAX_REACH = 5.3
"""Largest squared distance of a pixel from the centre in standard deviations: 4 in an ellipse, 6 in a square."""
_EDGE_DARKNESS = 0.25
"""Pixels that are darker than the board by this share of the contrast belong to a circle."""
_MARGIN = 4
"""Pixels about a circle that are looked at."""
_MIN_BRIGHT_RING = 0.6
"""Least share of the ring about a circle that must show the even board; the rest may be beyond the board's edge."""
_MAX_RING_SPREAD = 0.1
"""Greatest standard deviation of the board about a circle, in contrasts."""


class CircleReading(NamedTuple):
    """Centroid (u, v) [px] of a circle's image and its area [px]."""

    u: float
    v: float
    area: float


def read_window(image, window, threshold):
    """Returns the `CircleReading` of the dark pixels in an operator's window.

    The centroid is the sum of the dark pixels' addresses (accumulative histogram) over their number (frequency
    histogram); the text prints the division upside down.

    Args:
        image: grey uint8 (h, w).
        window: rectangle (u0, v0, width, height) [px] that holds one circle; what its border cuts does not count.
        threshold: pixels that are no brighter [grey] are dark.

    Raises DrakeTrackerError when the window is not in the image, or holds no whole circle or more than one.
    """
    u0, v0, width, height = (int(value) for value in window)
    where = f"the window {width} x {height} px at ({u0}, {v0})"
    if min(u0, v0) < 0 or min(width, height) < 1 or u0 + width > image.shape[1] or v0 + height > image.shape[0]:
        raise DrakeTrackerError(f"{where} is not within the image of {image.shape[1]} x {image.shape[0]} px")
    dark = cv2.compare(np.ascontiguousarray(image[v0 : v0 + height, u0 : u0 + width]), float(threshold), cv2.CMP_LE)
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(dark, connectivity=8)
    left, top, w, h, area = statistics.T
    whole = (left > 0) & (top > 0) & (left + w < width) & (top + h < height) & (area >= MIN_AREA)
    whole[0] = False
    circles = np.flatnonzero(whole)
    if len(circles) == 0:
        raise DrakeTrackerError(
            f"{where} holds no whole circle darker than {threshold:g}; move or enlarge it, or raise the threshold"
        )
    if len(circles) > 1:
        raise DrakeTrackerError(f"{where} holds {len(circles)} dark areas; it must hold one circle: make it smaller")
    moments = cv2.moments((labels == circles[0]).view(np.uint8), binaryImage=True)
    area = moments["m00"]
    return CircleReading(u0 + moments["m10"] / area, v0 + moments["m01"] / area, area)


def best_reading(readings):
    """Returns the reading with the largest area: the paper takes ten, because pixels near the threshold flicker."""
    return max(readings, key=lambda reading: reading.area)


def find_circles(images, count=4):
    """Returns the `CircleReading`s of all that looks like a dark circle in an image, the largest first.

    Small dark things (the pegs on the board) look like circles too; which of the readings are those of the board is
    for `circle_pose.locate_board` to find out.

    Args:
        images: grey image (h, w), or several of one scene (n, h, w), which are averaged first.
        count: least number of circles.

    Raises DrakeTrackerError when fewer are found.
    """
    image = np.asarray(images, dtype=np.float32)
    if image.ndim == 3:
        image = image.mean(axis=0)
    readings = sorted(_candidates(image), key=lambda reading: -reading.area)
    if len(readings) < count:
        raise DrakeTrackerError(
            f"found {len(readings)} of {count} dark circles; one may be hidden or out of view: clear the view, or "
            "move the camera until it sees the whole board"
        )
    return readings


def _candidates(image):
    """Returns the readings of all that looks like a dark circle in a float32 image."""
    grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    block = max(11, int(_BLOCK_SHARE * min(grey.shape))) | 1
    method = cv2.ADAPTIVE_THRESH_MEAN_C
    dark = cv2.adaptiveThreshold(grey, 255, method, cv2.THRESH_BINARY_INV, block, MIN_CONTRAST / 2)
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(dark, connectivity=4)
    readings = []
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
            reading = _weigh(image[patch], blob, left - margin, top - margin)
            if reading is not None:
                readings.append(reading)
    return readings


def _is_elliptic(blob):
    """Tells whether the white pixels of a mask fill about an ellipse that is not too thin."""
    v, u = np.nonzero(blob)
    points = np.column_stack([u, v]).astype(float)
    points -= points.mean(axis=0)
    covariance = points.T @ points / len(points) + np.eye(2) / 12.0
    axes = np.linalg.eigvalsh(covariance)
    if axes[1] > _MAX_AXIS_RATIO**2 * axes[0]:
        return False
    reach = np.einsum("ni,ij,nj->n", points, np.linalg.inv(covariance), points).max()
    full = len(points) / (4.0 * np.pi * np.sqrt(axes[0] * axes[1]))
    return reach <= _MAX_REACH and 0.85 < full < 1.1


def _weigh(patch, blob, u0, v0):
    """Returns the reading of a blob, its pixels weighed by their darkness, or None when no even board surrounds it.

    The board's brightness is a plane through the ring about the blob: an uneven light does not shift the centroid. The
    rim is kept narrow, because the board's edge may be two pixels away.
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
    return CircleReading(
        u0 + float((weights * u).sum() / total), v0 + float((weights * v).sum() / total), float(total / contrast)
    )
