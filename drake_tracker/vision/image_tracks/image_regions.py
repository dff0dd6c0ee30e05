"""All moving regions of a mask, where `region_centroid.hull_centroid` returns the largest one only."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.region_centroid import MINIMUM_FRAGMENT_PIXELS, MINIMUM_FRAGMENT_SHARE, row_ends

MOST_REGIONS = 40
"""Largest number of regions of an image that are used; the largest regions count."""


LEAST_CHANGE, CHANGE_NOISE = 10.0, 8.0
"""Least change between two images that shows an object, in grey levels and in medians of all changes."""
MIDWAY = 0.5
"""A fast object is this share of its size or less away from the middle of the two places where it appears."""
BOTH_PLACES = (1.4, 2.8)
"""Moving pixels of a region that shows both places of an object but not the object itself, in multiples of the object's
own pixels."""


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
        exact: whether it shows the object where it is, without where it was in the image before and will be.
        inner: the only exact region inside, if there is exactly one.
    """

    u: float
    v: float
    pixel_count: int
    left: int
    top: int
    width: int
    height: int
    exact: bool = False
    inner: "ImageRegion | None" = None

    @property
    def extent(self) -> float:
        """Mean of width and height [px]."""
        return 0.5 * (self.width + self.height)

    def distance(self, u: float, v: float) -> float:
        """Returns the distance of a point (u, v) from the rectangle round the region [px], 0 inside."""
        right, bottom = self.left + self.width - 1, self.top + self.height - 1
        return math.hypot(max(self.left - u, u - right, 0.0), max(self.top - v, v - bottom, 0.0))

    def gap(self, other: "ImageRegion") -> float:
        """Returns the distance between the rectangles round two regions [px], 0 where they overlap."""
        across = max(self.left - other.left - other.width, other.left - self.left - self.width, 0)
        down = max(self.top - other.top - other.height, other.top - self.top - self.height, 0)
        return math.hypot(across, down)


def changed_twice(images: Sequence[np.ndarray]) -> np.ndarray:
    """Returns the pixels at which the middle of three images differs from both others: uint8 (h, w), 255 at these
    pixels.

    Args:
        images: grey uint8 (h, w), oldest first.
    """
    before, middle, after = images
    differences = [cv2.absdiff(middle, each) for each in (before, after)]
    threshold = max(LEAST_CHANGE, CHANGE_NOISE * float(np.median(differences[0][::4, ::4])))
    change = cv2.min(*differences)
    return cv2.threshold(change, threshold, 255, cv2.THRESH_BINARY)[1]


def join_fast(regions: Sequence[ImageRegion], now: Sequence[ImageRegion]) -> list[ImageRegion]:
    """Returns the regions, largest first. Exact regions of fast objects replace the regions of their earlier and later
    places, or lie inside of them.

    An object that moves by more than its size between images appears twice in their difference, where it was and where
    it will be, and not where it is. If the object turns back, both places are on the same side of the object, and may
    form one region or cancel each other.

    Args:
        regions: of the difference of the images before and after.
        now: of `changed_twice`.
    """
    rest = [_with_inner(each, now) for each in regions]
    found = []
    for region in now:
        if any(each.distance(region.u, region.v) == 0.0 for each in rest):
            continue
        found.append(region._replace(exact=True))
        turned = next((each for each in rest if _shows_both_places(each, region, now)), None)
        if turned is not None:
            rest.remove(turned)
            continue
        beside = [each for each in rest if 0.5 < each.extent / region.extent < 2.0]
        if len(beside) < 2:
            continue
        places = np.array([each[:2] for each in beside])
        off = np.linalg.norm(0.5 * (places[:, None] + places) - (region.u, region.v), axis=2)
        off[np.tril_indices(len(off))] = np.inf
        i, j = np.unravel_index(int(off.argmin()), off.shape)
        if off[i, j] < MIDWAY * region.extent:
            rest = [each for each in rest if each not in (beside[i], beside[j])]
    return sorted(rest + found, key=lambda each: -each.pixel_count)


def _shows_both_places(region: ImageRegion, thing: ImageRegion, now: Sequence[ImageRegion]) -> bool:
    """Returns whether a region shows the earlier and the later place of an object, both on the same side of the object.

    Args:
        region: without an exact region in it.
        thing: the object, exact.
        now: all exact regions.
    """
    low, high = BOTH_PLACES
    if not low < region.pixel_count / thing.pixel_count < high or region.gap(thing) > thing.extent:
        return False
    return not any(region.distance(each.u, each.v) == 0.0 for each in now)


def _with_inner(region: ImageRegion, now: Sequence[ImageRegion]) -> ImageRegion:
    """Returns a region with its exact region, if there is exactly one."""
    inside = [each for each in now if region.distance(each.u, each.v) == 0.0]
    return region if len(inside) != 1 else region._replace(inner=inside[0]._replace(exact=True))


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
    kept = np.count_nonzero(keep)
    if kept == 0:
        return []
    points, least = cv2.findNonZero(mask).reshape(-1, 2), max(min_pixels, 1)
    owned = [points]  # of a single fragment
    if kept > 1 or len(keep) > 2:
        fragment_of = labels[points[:, 1], points[:, 0]]
        points, fragment_of = points.compress(keep[fragment_of], axis=0), fragment_of.compress(keep[fragment_of])
        left, top, width, height = cv2.boundingRect(points)  # the fragments kept are often in a small part of the mask
        u0, v0, points = u0 + left, v0 + top, points - np.array([left, top], np.int32)
        owned = [points] if kept == 1 else _divide(points, (height, width), join_distance, sizes[fragment_of], least)
    found = []
    for own in owned:
        if len(own) < least:
            continue
        moments = cv2.moments(cv2.convexHull(row_ends(own)))
        if moments["m00"] > 0.0:
            u, v = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        else:  # All pixels on one line: the hull has no area.
            u, v = own.mean(axis=0)
        left, top, width, height = cv2.boundingRect(own)
        found.append(ImageRegion(float(u) + u0, float(v) + v0, len(own), left + u0, top + v0, width, height))
    return found


def _divide(
    points: np.ndarray, shape: tuple[int, int], join_distance: float, sizes: np.ndarray, least: int
) -> list[np.ndarray]:
    """Returns the points (m, 2) of each region without its smallest fragments, the largest regions first.

    Args:
        points: of all regions (n, 2), columns and rows.
        shape: of the image.
        join_distance: see `find_regions`.
        sizes: number of points of the fragment that each point belongs to, shape (n,).
        least: least number of points of a region.
    """
    region_of = _join(points, shape, int(join_distance) + 1)
    pixels = np.bincount(region_of)
    wanted = sizes >= MINIMUM_FRAGMENT_SHARE * pixels[region_of]
    largest = [number for number in np.argsort(-pixels)[:MOST_REGIONS] if pixels[number] >= least]
    return [points[(region_of == number) & wanted] for number in largest]


def _join(points: np.ndarray, shape: tuple[int, int], side: int) -> np.ndarray:
    """Returns the number of the region of each point (n, 2) of an image, once each is grown to a square.

    Args:
        points: (n, 2), columns and rows.
        shape: of the image.
        side: of the square [px].
    """
    fragments = np.zeros(shape, np.uint8)
    fragments[points[:, 1], points[:, 0]] = 1
    joined = cv2.dilate(fragments, np.ones((side, side), np.uint8))
    regions: np.ndarray = cv2.connectedComponents(joined, connectivity=8)[1]
    return regions[points[:, 1], points[:, 0]]
