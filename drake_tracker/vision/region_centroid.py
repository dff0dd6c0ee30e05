"""From a mask of moving pixels to one centroid: the paper's histogram mean, or the convex hull of the region.

A mask is a uint8 image (h, w), 255 where something moves and 0 elsewhere. Coordinates are pixel coordinates of the
mask: whole numbers are pixel centres, (0, 0) is the top left pixel.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import cv2
import numpy as np

MINIMUM_FRAGMENT_PIXELS = 4
"""Fragments of a moving region with fewer pixels are stray pixels."""
MINIMUM_FRAGMENT_SHARE = 0.02
"""Fragments with a smaller share of all moving pixels are stray pixels too."""
BRIGHTNESS_PERCENTILE = 90
"""Moving pixels as bright as this percentile are assumed to show the object itself."""
BRIGHTNESS_FRACTION = 0.2
"""A pixel passes the brightness gate when it lies at least this fraction of the way from the brightness of the still
background to that of the object."""

Number = TypeVar("Number", float, np.ndarray)


class RegionCentroid(NamedTuple):
    """Centroid of a moving region.

    Attributes:
        u: column of the centroid [px].
        v: row of the centroid [px].
        pixel_count: number of moving pixels from which it was computed.
    """

    u: float
    v: float
    pixel_count: int


def find_centroid(mask: np.ndarray, kind: str, join_distance: float, min_pixels: int) -> RegionCentroid | None:
    """Returns the `RegionCentroid` of a mask, or None when too few pixels move.

    Args:
        mask: uint8 (h, w).
        kind: "mean" for `mean_centroid`, "hull" for `hull_centroid`.
        join_distance: of the hull [px].
        min_pixels: least number of moving pixels.
    """
    region = mean_centroid(mask) if kind == "mean" else hull_centroid(mask, join_distance)
    if region is None or region.pixel_count < min_pixels:
        return None
    return region


def mean_centroid(mask: np.ndarray) -> RegionCentroid | None:
    """Returns the `RegionCentroid` of all moving pixels of a mask, or None when there are none.

    Steps 9-11 of figure 3 of Allen et al. 1991: each moving pixel is encoded with its coordinate by a ramp, the encoded
    image is histogrammed, and the mean of the histogram is taken. The histogram of an image that holds its own column
    numbers is the count of moving pixels per column. This count is summed here, and the count per row.
    """
    columns = cv2.reduce(mask, 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S).ravel()
    rows = cv2.reduce(mask, 1, cv2.REDUCE_SUM, dtype=cv2.CV_32S).ravel()
    total = int(columns.sum())
    if total == 0:
        return None
    u = float(columns @ np.arange(columns.size)) / total
    v = float(rows @ np.arange(rows.size)) / total
    return RegionCentroid(u, v, total // 255)


def hull_centroid(mask: np.ndarray, join_distance: float) -> RegionCentroid | None:
    """Returns the `RegionCentroid` of the convex hull of the largest moving region, or None when there is none.

    Motion is visible at edges only, so that the mean of the moving pixels is biased towards the strong edges, and the
    bias changes as the object turns. The area inside the outermost edges has no such bias.

    The hull depends on its outermost pixels, so these must belong to the object. Fragments of a few pixels are dropped.
    Fragments at most ``join_distance`` apart, horizontally and vertically, are taken as edges of one region, and the
    region with most moving pixels is used.

    Args:
        mask: uint8 (h, w).
        join_distance: the longest gap [px] that an untextured object leaves between its front and rear edges.
    """
    u0, v0, width, height = cv2.boundingRect(mask)
    if width == 0:
        return None
    mask = mask[v0 : v0 + height, u0 : u0 + width]
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    sizes = statistics[:, cv2.CC_STAT_AREA]
    smallest = max(MINIMUM_FRAGMENT_PIXELS, MINIMUM_FRAGMENT_SHARE * cv2.countNonZero(mask))
    keep = (sizes >= smallest).view(np.uint8)
    keep[0] = 0
    kept = np.count_nonzero(keep)
    if kept == 0:
        return None
    fragments = keep.take(labels)
    points = cv2.findNonZero(fragments).reshape(-1, 2)
    if kept > 1:
        points = _largest_region(points, fragments, int(join_distance) + 1)
    moments = cv2.moments(cv2.convexHull(row_ends(points)))
    if moments["m00"] > 0.0:
        u, v = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
    else:  # All pixels on one line: the hull has no area.
        u, v = points.mean(axis=0)
    return RegionCentroid(float(u) + u0, float(v) + v0, len(points))


def _largest_region(points: np.ndarray, fragments: np.ndarray, side: int) -> np.ndarray:
    """Returns the points (n, 2) of ``fragments`` that belong to the largest region once each is grown to a square.

    Args:
        points: pixels (u, v) of the fragments, shape (n, 2).
        fragments: uint8 (h, w), 1 at these pixels.
        side: of the square [px].
    """
    joined = cv2.dilate(fragments, np.ones((side, side), np.uint8))
    count, regions = cv2.connectedComponents(joined, connectivity=8)
    if count == 2:  # The background and one region.
        return points
    region_of_point = regions[points[:, 1], points[:, 0]]
    return points[region_of_point == np.bincount(region_of_point).argmax()]


def row_ends(points: np.ndarray) -> np.ndarray:
    """Returns the first and the last of the points (n, 2) of every row: no other can be a corner of their hull.

    The points come row by row, from left to right. The ends are several times fewer, which saves the hull most of its
    sorting.
    """
    rows = points[:, 1]
    ends = np.ones(len(points), bool)
    ends[1:-1] = rows[2:] != rows[:-2]
    return points.compress(ends, axis=0)


def brightness_gate(mask: np.ndarray, images: Sequence[np.ndarray], background: float) -> np.ndarray:
    """Returns the mask without the moving pixels that are never clearly brighter than the background.

    A cast shadow moves with the object and darkens the table: its pixels show either the table or the shadow. A pixel
    on the object's outline shows the object in one image and the background in another, so that the brightest image
    decides. This is for objects that are brighter on all sides than the background: a side that no lamp reaches is
    dropped like a shadow.

    Args:
        mask: the moving pixels, uint8 (h, w).
        images: the images between which they move, each of the mask's shape, in any unit of brightness.
        background: brightness of the background, such as the median of the image.
    """
    moving = mask > 0
    if not moving.any():
        return mask
    brightest = np.max([image[moving] for image in images], axis=0)
    object_brightness = np.percentile(brightest, BRIGHTNESS_PERCENTILE)
    gated = np.zeros_like(mask)
    gated[moving] = 255 * (brightest > background + BRIGHTNESS_FRACTION * (object_brightness - background))
    return gated


def reduced(image: np.ndarray, factor: int) -> np.ndarray:
    """Returns an image reduced by a whole factor: each pixel is the mean of a square, an incomplete square is left out.

    Args:
        image: uint8 (h, w).
        factor: 1 or more; 1 returns the image itself.
    """
    if factor == 1:
        return image
    height, width = (size // factor for size in image.shape)
    whole = image[: factor * height, : factor * width]
    return cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)


def enlarged_centroid(centroid: RegionCentroid, factor: int) -> RegionCentroid:
    """Returns a centroid in a reduced image in pixels of the full one."""
    u, v = (enlarged_place(value, factor) for value in centroid[:2])
    return RegionCentroid(u, v, centroid.pixel_count * factor**2)


def enlarged_place(value: Number, factor: int) -> Number:
    """Returns coordinates of the middle of a pixel of a reduced image in the full one [px]."""
    return factor * value + 0.5 * (factor - 1)
