"""From the silhouettes in one image to regions, one for each object: centroids, extents and their uncertainty.

`silhouettes.find_silhouettes` finds which silhouettes lie in the windows of the tracked objects, and `make_regions`
makes a region of each. A silhouette that shows several objects is divided among them, once it is known where they stand
(`division.place_objects`). A region in no window belongs to a new object.
"""

from collections.abc import Mapping
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.object_shape import polygon_slant
from drake_tracker.vision.silhouettes.silhouettes import FRAGMENT_PIXELS, ImageSilhouettes
from drake_tracker.vision.silhouettes.split_silhouettes import Part, divide

BESIDE = np.ones((7, 7), np.uint8)
"""Distance in pixels at which the arm, or the edge of the valid area of a camera that has turned away, touches a
region."""
SHAPE_ERROR = 0.03
"""Standard deviation of a silhouette's centroid as a fraction of its extent: which part of an object is visible depends
on its heading."""
SHARED_ERROR = 0.07
"""The same for an object whose silhouette is merged with the silhouette of another object, or partly covered by the
arm."""
MISSING_ERROR = 0.4
"""The same for an invisible object; for a partly visible object, a fraction of this value."""
MISSING_SHARE = 0.15
"""Pixels that a silhouette may lack as a share of those expected before the object counts as partly hidden."""
JITTER = 0.25
"""Standard deviation of a centroid from image to image [px]."""
NO_COLOUR = (0.0, 0.0, 0.0)


class Region(NamedTuple):
    """One image of one object.

    Attributes:
        u: column of the centroid [px], full frame.
        v: row [px].
        pixels: number of its pixels.
        width: extent along u [px].
        height: extent along v [px].
        slant: how its hull lies across the axes of the image, see `object_shape.polygon_slant` [px].
        var_u: variance of the centroid along u, its shape bias included [px^2].
        var_v: variance along v [px^2].
        moving: share of its pixels that move.
        share: visible share of the object, 1 where it is not known.
        track: number of the track in whose window it lies; 0: none, -1: a track that is not yet confirmed.
        shared: whether it was cut out of a silhouette that shows several objects.
        apart: whether another large fragment lies in its window, which no other track expects.
        covered: whether the robot's own arm covers a part of it, or the border of the examined area cuts a part off. It
            is placed so that the object's outline fits the rest.
        beyond: whether the latter is so.
        cut: truncated: the region touches the border of the examined area without being placed there, or the edge of
            the valid area, so that its centroid is the centroid of a part of the object.
        colour: its mean colour, red, green and blue [grey levels].
    """

    u: float
    v: float
    pixels: int
    width: float
    height: float
    slant: float
    var_u: float
    var_v: float
    moving: float
    share: float
    track: int
    shared: bool
    apart: bool
    covered: bool
    beyond: bool
    cut: bool
    colour: tuple[float, float, float]

    @property
    def whole(self) -> bool:
        """Whether its silhouette shows the whole object and nothing else."""
        return not (self.shared or self.covered)

    @property
    def extents(self) -> np.ndarray:
        """Extents along u and v, shape (2,) [px]."""
        return np.array([self.width, self.height])


def make_regions(silhouettes: ImageSilhouettes, places: Mapping[int, np.ndarray], colours: bool = True) -> list[Region]:
    """Returns the regions of one image: first the regions in windows, in the order of the windows, then the others,
    largest first.

    Args:
        silhouettes: of the image.
        places: places of partly hidden objects: {index of the window: (u, v) [px]}.
        colours: whether to compute the colours of the regions.
    """
    regions = []
    for silhouette in silhouettes.expected:
        for number, part in divide(silhouettes, silhouette, places):
            region = _region(part, silhouettes, number, colours)
            if region is not None and region.pixels >= FRAGMENT_PIXELS:
                regions.append(region)
    others = [_region(Part(pixels), silhouettes, None, colours) for pixels in silhouettes.others]
    return regions + sorted((each for each in others if each is not None), key=lambda each: -each.pixels)


def _error(share: float, shared: bool, covered: bool) -> float:
    """Returns the variance of a centroid, as a share of the square of the extent.

    Args:
        share: visible share of the object.
        shared: whether it was cut out of a silhouette that shows several objects.
        covered: whether the arm covers the rest of it. It was placed so that its outline fits what is visible.
    """
    if covered:
        return SHAPE_ERROR**2 + SHARED_ERROR**2 / share
    missing = max(1.0 - share - MISSING_SHARE, 0.0)
    return SHAPE_ERROR**2 + (MISSING_ERROR * missing) ** 2 + (SHARED_ERROR**2 if shared else 0.0)


def _is_cut(foreground: Foreground, pixels: np.ndarray, box: tuple[slice, slice], covered: bool) -> bool:
    """Returns whether the pixels of a region, given for a box of the image, show only a part of the object."""
    border = None if covered else foreground.border
    if border is not None and cv2.countNonZero(cv2.bitwise_and(pixels, border[box])):
        return True
    return _touches(foreground.missing, pixels, box)


def _touches(mask: np.ndarray | None, pixels: np.ndarray, box: tuple[slice, slice]) -> bool:
    """Returns whether the pixels of a region, given for a box of the image, touch a mask of the image."""
    if mask is None:
        return False
    return cv2.countNonZero(cv2.bitwise_and(pixels, cv2.dilate(mask, BESIDE)[box])) > 0


def _region(part: Part, silhouettes: ImageSilhouettes, number: int | None, colours: bool) -> Region | None:
    """Returns the region of a part of a silhouette, None without pixels.

    Args:
        part: the part.
        silhouettes: of the image.
        number: place of the object's window, None without one.
        colours: whether to compute the colour.
    """
    foreground, box, offset = silhouettes.foreground, silhouettes.box, silhouettes.offset
    window = None if number is None else silhouettes.windows[number]
    pixels = cv2.countNonZero(part.pixels)
    if pixels == 0:
        return None
    left, top, width, height = cv2.boundingRect(part.pixels)
    inner = slice(top, top + height), slice(left, left + width)
    piece = part.pixels[inner]
    outlines = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    hull = cv2.convexHull(outlines[0] if len(outlines) == 1 else np.concatenate(outlines))
    if part.centre is None:
        moments = cv2.moments(hull)
        if moments["m00"] > 0.0:
            u, v = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        else:  # All pixels on one line: the hull has no area.
            u, v = 0.5 * (width - 1), 0.5 * (height - 1)
        u, v = u + left + offset[0], v + top + offset[1]
    else:
        u, v = part.centre
    moving = cv2.countNonZero(cv2.bitwise_and(piece, foreground.moving[box][inner])) / pixels
    share = 1.0 if window is None or window.pixels <= 0.0 else min(pixels / window.pixels, 1.0)
    extents = (float(width), float(height))
    if window is not None:
        expected_width, expected_height = window.extents.tolist()
        extents = (max(extents[0], expected_width), max(extents[1], expected_height))
    covered = _touches(foreground.hidden, part.pixels, box) if window is None else number in silhouettes.covered
    error = _error(share, part.shared, covered)
    var_u, var_v = (JITTER**2 + error * (extent * extent) for extent in extents)
    colour = NO_COLOUR
    if colours:
        colour = cv2.mean(foreground.image[box][inner], mask=piece)[:3]
    return Region(
        u=float(u),
        v=float(v),
        pixels=pixels,
        width=float(width),
        height=float(height),
        slant=polygon_slant(hull),
        var_u=var_u,
        var_v=var_v,
        moving=moving,
        share=share,
        track=0 if window is None else window.track,
        shared=part.shared,
        apart=number in silhouettes.apart,
        covered=covered,
        beyond=number in silhouettes.beyond,
        cut=_is_cut(foreground, part.pixels, box, covered),
        colour=(float(colour[0]), float(colour[1]), float(colour[2])),
    )
