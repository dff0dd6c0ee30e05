"""All moving regions of a mask, where `region_centroid.hull_centroid` returns the largest one only."""

from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.region_centroid import MINIMUM_FRAGMENT_PIXELS, MINIMUM_FRAGMENT_SHARE

MOST_REGIONS = 40
"""Only so many regions of an image are used, the largest ones."""


class ImageRegion(NamedTuple):
    """A moving region of an image.

    Attributes:
        u: column of the centroid of its convex hull [px].
        v: row [px].
        pixel_count: number of moving pixels.
        left: first column [px].
        top: first row [px].
        width: number of columns [px].
        height: number of rows [px].
    """

    u: float
    v: float
    pixel_count: int
    left: int
    top: int
    width: int
    height: int

    @property
    def extent(self) -> float:
        """Mean of width and height [px]."""
        return 0.5 * (self.width + self.height)

    def distance(self, u: float, v: float) -> float:
        """Returns the distance of a point (u, v) from the rectangle round the region [px], 0 inside."""
        right, bottom = self.left + self.width - 1, self.top + self.height - 1
        return float(np.hypot(max(self.left - u, u - right, 0.0), max(self.top - v, v - bottom, 0.0)))


def find_regions(mask: np.ndarray, join_distance: float, min_pixels: int) -> list[ImageRegion]:
    """Returns the moving regions of a mask, largest first, at most `MOST_REGIONS`.

    As in `region_centroid.hull_centroid`, fragments of a few pixels are dropped, and those at most ``join_distance``
    apart are edges of one region.

    Args:
        mask: uint8 (h, w), 255 where something moves.
        join_distance: longest gap [px] that an untextured object leaves between its front and rear edges.
        min_pixels: least number of moving pixels of a region.
    """
    u0, v0, width, height = cv2.boundingRect(mask)
    if width == 0:
        return []
    mask = mask[v0 : v0 + height, u0 : u0 + width]
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    sizes = statistics[:, cv2.CC_STAT_AREA]
    keep = sizes >= MINIMUM_FRAGMENT_PIXELS
    keep[0] = False
    if not keep.any():
        return []
    fragments = keep.view(np.uint8).take(labels)
    side = int(join_distance) + 1
    joined = cv2.dilate(fragments, np.ones((side, side), np.uint8))
    regions = cv2.connectedComponents(joined, connectivity=8)[1]
    points = cv2.findNonZero(fragments).reshape(-1, 2)
    fragment_of, region_of = labels[points[:, 1], points[:, 0]], regions[points[:, 1], points[:, 0]]
    pixels = np.bincount(region_of)
    wanted = sizes[fragment_of] >= MINIMUM_FRAGMENT_SHARE * pixels[region_of]
    found = []
    for number in np.argsort(-pixels)[:MOST_REGIONS]:
        if pixels[number] < max(min_pixels, 1):
            break
        own = points[(region_of == number) & wanted]
        if len(own) < max(min_pixels, 1):
            continue
        moments = cv2.moments(cv2.convexHull(own))
        if moments["m00"] > 0.0:
            u, v = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        else:  # All pixels on one line: the hull has no area.
            u, v = own.mean(axis=0)
        left, top = (int(value) for value in own.min(axis=0))
        right, bottom = (int(value) for value in own.max(axis=0))
        found.append(
            ImageRegion(float(u) + u0, float(v) + v0, len(own), left + u0, top + v0, right - left + 1, bottom - top + 1)
        )
    return found
