"""From the silhouettes in one image to regions, one for each object: centroids, extents and their uncertainty.

A region that shows several objects is divided among the windows in which these objects are expected: each of its pixels
goes to the nearest one. A region in no window belongs to a new object.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.background_model import Foreground

REGION_SLOTS = 16
"""Regions of one image that are reported."""
FRAGMENT_PIXELS = 6
"""Fragments of a silhouette with fewer pixels are noise."""
CLAIM_MARGIN = 2.0
"""Distance [px] by which a fragment may lie outside the gate of a window that claims it."""
REACH = 1.35
"""Pixels farther from a window's centre than this many radii belong to another object."""
OVERSIZE = 1.6
"""A region that is this many times as wide or high as its object shows another one too."""
SHAPE_ERROR = 0.055
"""Standard deviation of a silhouette's centroid as a fraction of its extent: which part of an object is visible depends on
its heading."""
JITTER = 0.25
"""Standard deviation of a centroid from image to image [px]."""
NO_COLOUR = (0.0, 0.0, 0.0)


class ObjectWindow(NamedTuple):
    """Where an object is expected in one image.

    Attributes:
        track: number of its track.
        u: column of the expected centroid [px], full frame.
        v: row [px].
        std: standard deviation of the expectation [px].
        width: expected extent along u [px].
        height: expected extent along v [px].
        pixels: expected number of pixels.
    """

    track: int
    u: float
    v: float
    std: float
    width: float
    height: float
    pixels: float

    @property
    def radius(self) -> float:
        """Radius of a disc that contains the object [px]."""
        return 0.5 * float(np.hypot(self.width, self.height)) + 1.0


class Region(NamedTuple):
    """What one image shows of one object.

    Attributes:
        u: column of the centroid [px], full frame.
        v: row [px].
        pixels: number of its pixels.
        width: extent along u [px].
        height: extent along v [px].
        var_u: variance of the centroid along u, its shape bias included [px^2].
        var_v: variance along v [px^2].
        moving: share of its pixels that move.
        share: visible share of the object, 1 where it is not known.
        track: number of the track in whose window it lies; 0: none.
        shared: whether it was cut out of a region that shows several objects.
        colour: its mean colour, red, green and blue [grey levels].
    """

    u: float
    v: float
    pixels: int
    width: float
    height: float
    var_u: float
    var_v: float
    moving: float
    share: float
    track: int
    shared: bool
    colour: tuple[float, float, float]


def find_regions(
    foreground: Foreground, windows: Sequence[ObjectWindow] = (), min_pixels: int = 25, colours: bool = True
) -> list[Region]:
    """Returns the regions of one image: first those in windows, in their order, then the others, largest first.

    Args:
        foreground: silhouettes and moving pixels.
        windows: where objects are expected.
        min_pixels: least number of pixels of a region.
        colours: whether to compute the colours of the regions.
    """
    u0, v0, width, height = cv2.boundingRect(foreground.mask)
    if width == 0:
        return []
    box = slice(v0, v0 + height), slice(u0, u0 + width)
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(foreground.mask[box], connectivity=8)
    offset = np.array([u0 + foreground.image_offset[0], v0 + foreground.image_offset[1]], float)
    fragments = [label for label in range(1, count) if statistics[label, cv2.CC_STAT_AREA] >= FRAGMENT_PIXELS]
    claims: dict[int, list[int]] = {}
    free = []
    for label in fragments:
        claimed = _claimed_by(statistics[label], offset, windows)
        for number in claimed:
            claims.setdefault(number, []).append(label)
        if not claimed and statistics[label, cv2.CC_STAT_AREA] >= min_pixels:
            free.append((labels == label).view(np.uint8))
    contested = {label for label in fragments if sum(label in mine for mine in claims.values()) > 1}
    parts = [(0, part, False) for part in free]
    pixel_sets: list[tuple[int, np.ndarray, bool]] = []
    for number, mine in claims.items():
        part, shared = _part_of(number, mine, contested, labels, offset, windows)
        pixel_sets.append((number, part, shared))
    rest = _unclaimed(claims, labels, [part for _, part, _ in pixel_sets], windows, min_pixels)
    regions = []
    for number, part, shared in pixel_sets:
        region = _region(part, foreground, box, offset, windows[number], shared, colours)
        if region is not None and region.pixels >= FRAGMENT_PIXELS:
            regions.append(region)
    others = [_region(part, foreground, box, offset, None, False, colours) for _, part, _ in parts]
    others += [_region(part, foreground, box, offset, None, True, colours) for part in rest]
    return regions + sorted((each for each in others if each is not None), key=lambda each: -each.pixels)


def _claimed_by(statistics: np.ndarray, offset: np.ndarray, windows: Sequence[ObjectWindow]) -> list[int]:
    """Returns the places in ``windows`` of those that claim a fragment, from its row of component statistics."""
    u, v, width, height, pixels = statistics
    low = offset + (u, v)
    high = low + (width - 1, height - 1)
    found = []
    for number, window in enumerate(windows):
        centre = np.array([window.u, window.v])
        outside = float(np.hypot(*np.maximum(np.maximum(low - centre, centre - high), 0.0)))
        gate = 3.0 * window.std + CLAIM_MARGIN
        inner = float(np.hypot(*(0.5 * (low + high) - centre)))
        if outside <= gate or (pixels < window.pixels and inner <= window.radius + gate):
            found.append(number)
    return found


def _part_of(
    number: int,
    mine: Sequence[int],
    contested: set[int],
    labels: np.ndarray,
    offset: np.ndarray,
    windows: Sequence[ObjectWindow],
) -> tuple[np.ndarray, bool]:
    """Returns the pixels that belong to a window, uint8 of the labels' shape, and whether others share its fragments."""
    part = np.isin(labels, mine) if len(mine) > 1 else labels == mine[0]
    window = windows[number]
    shared = any(label in contested for label in mine)
    u, v, width, height = cv2.boundingRect(part.view(np.uint8))
    if not shared and width <= OVERSIZE * window.width + 4.0 and height <= OVERSIZE * window.height + 4.0:
        return part.view(np.uint8), False
    rows, columns = np.nonzero(part)
    points = np.column_stack([columns, rows]) + offset
    centres = np.array([[each.u, each.v] for each in windows])
    radii = np.array([each.radius for each in windows])
    distances = np.linalg.norm(points[:, None] - centres[None], axis=2) / radii
    kept = (distances.argmin(axis=1) == number) & (distances[:, number] <= REACH)
    result = np.zeros(labels.shape, np.uint8)
    result[rows[kept], columns[kept]] = 1
    return result, True


def _unclaimed(
    claims: dict[int, list[int]],
    labels: np.ndarray,
    parts: Sequence[np.ndarray],
    windows: Sequence[ObjectWindow],
    min_pixels: int,
) -> list[np.ndarray]:
    """Returns what is left of the fragments that windows claim, each uint8 of the labels' shape: further objects."""
    if not parts:
        return []
    claimed = sorted({label for mine in claims.values() for label in mine})
    left = np.isin(labels, claimed).view(np.uint8)
    for part in parts:
        left = cv2.subtract(left, part)
    if cv2.countNonZero(left) < min_pixels:
        return []
    left = cv2.morphologyEx(left, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, pieces, statistics, _ = cv2.connectedComponentsWithStats(left, connectivity=8)
    least = max(min_pixels, 0.3 * min(windows[number].pixels for number in claims))
    return [
        (pieces == label).view(np.uint8) for label in range(1, count) if statistics[label, cv2.CC_STAT_AREA] >= least
    ]


def _region(
    part: np.ndarray,
    foreground: Foreground,
    box: tuple[slice, slice],
    offset: np.ndarray,
    window: ObjectWindow | None,
    shared: bool,
    colours: bool,
) -> Region | None:
    """Returns the region of the pixels ``part`` (uint8, 1 where they are) in the box of the image, None without pixels."""
    pixels = cv2.countNonZero(part)
    if pixels == 0:
        return None
    left, top, width, height = cv2.boundingRect(part)
    inner = slice(top, top + height), slice(left, left + width)
    piece = part[inner]
    moments = cv2.moments(cv2.convexHull(cv2.findNonZero(piece)))
    if moments["m00"] > 0.0:
        u, v = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
    else:  # All pixels on one line: the hull has no area.
        u, v = 0.5 * (width - 1), 0.5 * (height - 1)
    moving = cv2.countNonZero(cv2.bitwise_and(piece, foreground.moving[box][inner])) / pixels
    share = 1.0 if window is None or window.pixels <= 0.0 else min(pixels / window.pixels, 1.0)
    full_width, full_height = (width, height) if window is None else (max(width, window.width), max(height, window.height))
    missing = max(1.0 - share - 0.15, 0.0) + (0.12 if shared else 0.0)
    var_u, var_v = (
        JITTER**2 + (SHAPE_ERROR * extent) ** 2 + (0.4 * missing * extent) ** 2 for extent in (full_width, full_height)
    )
    colour = NO_COLOUR
    if colours:
        colour = cv2.mean(foreground.image[box][inner], mask=piece)[:3]
    return Region(
        u=float(u + left + offset[0]),
        v=float(v + top + offset[1]),
        pixels=pixels,
        width=float(width),
        height=float(height),
        var_u=var_u,
        var_v=var_v,
        moving=moving,
        share=share,
        track=0 if window is None else window.track,
        shared=shared,
        colour=(float(colour[0]), float(colour[1]), float(colour[2])),
    )
