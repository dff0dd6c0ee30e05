"""From the silhouettes in one image to regions, one for each object: centroids, extents and their uncertainty.

`find_silhouettes` finds which silhouettes lie in the windows of the tracked objects, and `make_regions` makes a region
of each. A silhouette that shows several objects is divided among them, once it is known where they stand
(`division.place_merged`). A region in no window belongs to a new object.
"""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.division import Part, Silhouette, divide
from drake_tracker.vision.foreground import Foreground
from drake_tracker.vision.object_window import ObjectWindow

FRAGMENT_PIXELS = 6
"""Fragments of a silhouette with fewer pixels are noise."""
FRAGMENT_SHARE = 0.25
"""A fragment with a smaller share of the pixels of the largest one is a piece of the same object."""
CLAIM_MARGIN = 2.0
"""Distance [px] by which a fragment may lie outside the gate of a window that claims it."""
COVERED = 0.08
"""Share of an object's window that the arm may cover before the centroid counts as wrong."""
BESIDE = np.ones((7, 7), np.uint8)
"""Pixels next to which the arm, or the edge of what a camera that has turned away still sees, touches a region."""
LOCATED = 0.4
"""An object claims a share of a silhouette that shows others too if its position is known to this share of its
radius."""
SHAPE_ERROR = 0.03
"""Standard deviation of a silhouette's centroid as a fraction of its extent: which part of an object is visible depends
on its heading."""
SHARED_ERROR = 0.07
"""The same for an object whose silhouette is merged with that of another one."""
MISSING_ERROR = 0.4
"""The same where nothing of the object is visible; where a part of it is, a fraction of this."""
MISSING_SHARE = 0.15
"""Pixels that a silhouette may lack as a share of those expected before the object counts as partly hidden."""
JITTER = 0.25
"""Standard deviation of a centroid from image to image [px]."""
NO_COLOUR = (0.0, 0.0, 0.0)


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
        track: number of the track in whose window it lies; 0: none, -1: one that is not yet confirmed.
        shared: whether it was cut out of a silhouette that shows several objects.
        apart: whether another large fragment lies in its window, which no other track expects.
        covered: whether the robot's own arm covers a part of it.
        cut: whether it touches the edge of what a camera that has turned away still sees: its centroid is that of a
            part of the object.
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
    apart: bool
    covered: bool
    cut: bool
    colour: tuple[float, float, float]

    @property
    def extents(self) -> np.ndarray:
        """Extents along u and v, shape (2,) [px]."""
        return np.array([self.width, self.height])


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """The silhouettes of one image.

    Attributes:
        foreground: of the image.
        windows: where objects are expected.
        box: rows and columns of the image that contain all silhouettes; the arrays below are of this size.
        expected: silhouettes that lie in windows.
        others: pixels of all others, uint8, 1 where they are.
        apart: places in ``windows`` of objects beside which another large fragment lies in their window.
    """

    foreground: Foreground
    windows: Sequence[ObjectWindow]
    box: tuple[slice, slice]
    expected: Sequence[Silhouette]
    others: Sequence[np.ndarray]
    apart: Set[int]

    @property
    def offset(self) -> np.ndarray:
        """Full-frame coordinates of the top left pixel of the box, shape (2,) [px]."""
        rows, columns = self.box
        return np.array(self.foreground.image_offset, float) + (columns.start, rows.start)


def find_silhouettes(foreground: Foreground, windows: Sequence[ObjectWindow] = (), min_pixels: int = 25) -> Silhouettes:
    """Returns the silhouettes of one image.

    Args:
        foreground: silhouettes and moving pixels.
        windows: where objects are expected.
        min_pixels: least number of pixels of a silhouette in no window.
    """
    u0, v0, width, height = cv2.boundingRect(foreground.mask)
    box = slice(v0, v0 + height), slice(u0, u0 + width)
    if width == 0:
        return Silhouettes(foreground, windows, box, (), (), frozenset())
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(foreground.mask[box], connectivity=8)
    offset = np.array([u0 + foreground.image_offset[0], v0 + foreground.image_offset[1]], float)
    fragments = [label for label in range(1, count) if statistics[label, cv2.CC_STAT_AREA] >= FRAGMENT_PIXELS]
    claims: dict[int, list[int]] = {}
    for label in fragments:
        claimed = _claimed_by(statistics[label], offset, windows)
        located = [number for number in claimed if windows[number].std <= LOCATED * windows[number].radius]
        for number in located or claimed:
            claims.setdefault(number, []).append(label)
    own = {number: _joined(mine, statistics, offset, windows[number]) for number, mine in claims.items()}
    owned = {label for mine in own.values() for label in mine}
    apart = frozenset(number for number, mine in claims.items() if set(mine) - owned)
    others = [
        _pixels_of(labels, {label}, count)
        for label in fragments
        if label not in owned and statistics[label, cv2.CC_STAT_AREA] >= min_pixels
    ]
    expected = []
    pending = set(own)
    while pending:
        group = _sharing(pending.pop(), own)
        pending -= group
        whole = _pixels_of(labels, {label for number in group for label in own[number]}, count)
        expected.append(Silhouette(whole, offset, tuple(sorted(group))))
    return Silhouettes(foreground, windows, box, expected, others, apart)


def make_regions(silhouettes: Silhouettes, places: Mapping[int, np.ndarray], colours: bool = True) -> list[Region]:
    """Returns the regions of one image: first those in windows, in their order, then the others, largest first.

    Args:
        silhouettes: of the image.
        places: where the objects stand that share silhouettes: {place in the list of windows: (u, v) [px]}.
        colours: whether to compute the colours of the regions.
    """
    regions = []
    for silhouette in silhouettes.expected:
        for number, part in divide(silhouette, silhouettes.windows, places):
            region = _region(part, silhouettes, number, colours)
            if region is not None and region.pixels >= FRAGMENT_PIXELS:
                regions.append(region)
    others = [_region(Part(pixels), silhouettes, None, colours) for pixels in silhouettes.others]
    return regions + sorted((each for each in others if each is not None), key=lambda each: -each.pixels)


def _pixels_of(labels: np.ndarray, wanted: Set[int], count: int) -> np.ndarray:
    """Returns an image that is 1 at the pixels of some of the ``count`` labels, uint8."""
    if len(wanted) == 1:
        return (labels == next(iter(wanted))).view(np.uint8)
    lookup = np.zeros(count, np.uint8)
    lookup[list(wanted)] = 1
    return lookup[labels]


def _sharing(number: int, claims: Mapping[int, Sequence[int]]) -> set[int]:
    """Returns the windows that share fragments with one of them, directly or through others, itself included."""
    group, labels = {number}, set(claims[number])
    while True:
        more = {other for other, mine in claims.items() if other not in group and labels & set(mine)}
        if not more:
            return group
        group |= more
        labels.update(label for other in more for label in claims[other])


def _claimed_by(statistics: np.ndarray, offset: np.ndarray, windows: Sequence[ObjectWindow]) -> list[int]:
    """Returns the places in ``windows`` of those that claim a fragment, from its row of component statistics."""
    left, top, width, height, pixels = (float(value) for value in statistics)
    left, top = left + offset[0], top + offset[1]
    right, bottom = left + width - 1.0, top + height - 1.0
    found = []
    for number, window in enumerate(windows):
        outside = math.hypot(max(left - window.u, window.u - right, 0.0), max(top - window.v, window.v - bottom, 0.0))
        gate = 3.0 * window.std + CLAIM_MARGIN
        inner = math.hypot(0.5 * (left + right) - window.u, 0.5 * (top + bottom) - window.v)
        if outside <= gate or (pixels < window.pixels and inner <= window.radius + gate):
            found.append(number)
    return found


def _joined(mine: Sequence[int], statistics: np.ndarray, offset: np.ndarray, window: ObjectWindow) -> list[int]:
    """Returns those fragments of a window that show its object: the nearest large one, and all small ones.

    A second large fragment is another object, whose silhouette has just come apart from that of the first.
    """
    if len(mine) == 1:
        return list(mine)
    pixels = statistics[mine, cv2.CC_STAT_AREA]
    large = [label for label, count in zip(mine, pixels) if count >= FRAGMENT_SHARE * pixels.max()]
    centres = statistics[large, :2] + 0.5 * (statistics[large, 2:4] - 1) + offset
    nearest = large[int(np.hypot(*(centres - (window.u, window.v)).T).argmin())]
    return [label for label in mine if label == nearest or label not in large]


def covered_share(hidden: np.ndarray, offset: np.ndarray, window: ObjectWindow) -> float:
    """Returns the share of a window that a mask covers.

    Args:
        hidden: uint8 (h, w), 255 where the arm is, or where the image shows nothing.
        offset: full-frame coordinates of its top left pixel, shape (2,) [px].
        window: the window.
    """
    (width, height), (u, v) = 0.5 * window.extents, window.centre - offset
    left, right = max(round(u - width), 0), max(round(u + width) + 1, 0)
    top, bottom = max(round(v - height), 0), max(round(v + height) + 1, 0)
    view = hidden[top:bottom, left:right]
    return cv2.countNonZero(view) / view.size if view.size else 0.0


def _is_covered(
    foreground: Foreground, pixels: np.ndarray, box: tuple[slice, slice], window: ObjectWindow | None
) -> bool:
    """Returns whether the arm covers a part of an object's window, or touches the pixels of a new object."""
    if foreground.hidden is None:
        return False
    if window is not None:
        return covered_share(foreground.hidden, np.array(foreground.image_offset), window) > COVERED
    return _touches(foreground.hidden, pixels, box)


def _touches(mask: np.ndarray | None, pixels: np.ndarray, box: tuple[slice, slice]) -> bool:
    """Returns whether the pixels of a region, which are those of a box of the image, touch a mask of the image."""
    if mask is None:
        return False
    return cv2.countNonZero(cv2.bitwise_and(pixels, cv2.dilate(mask, BESIDE)[box])) > 0


def _region(part: Part, silhouettes: Silhouettes, number: int | None, colours: bool) -> Region | None:
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
    if part.centre is None:
        outlines = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
        moments = cv2.moments(cv2.convexHull(outlines[0] if len(outlines) == 1 else np.concatenate(outlines)))
        if moments["m00"] > 0.0:
            u, v = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        else:  # All pixels on one line: the hull has no area.
            u, v = 0.5 * (width - 1), 0.5 * (height - 1)
        u, v = u + left + offset[0], v + top + offset[1]
    else:
        u, v = part.centre
    moving = cv2.countNonZero(cv2.bitwise_and(piece, foreground.moving[box][inner])) / pixels
    share = 1.0 if window is None or window.pixels <= 0.0 else min(pixels / window.pixels, 1.0)
    extents = np.array([width, height], float)
    if window is not None:
        extents = np.maximum(extents, window.extents)
    missing = max(1.0 - share - MISSING_SHARE, 0.0)
    error = SHAPE_ERROR**2 + (MISSING_ERROR * missing) ** 2 + (SHARED_ERROR**2 if part.shared else 0.0)
    var_u, var_v = JITTER**2 + error * extents**2
    colour = NO_COLOUR
    if colours:
        colour = cv2.mean(foreground.image[box][inner], mask=piece)[:3]
    return Region(
        u=float(u),
        v=float(v),
        pixels=pixels,
        width=float(width),
        height=float(height),
        var_u=float(var_u),
        var_v=float(var_v),
        moving=moving,
        share=share,
        track=0 if window is None else window.track,
        shared=part.shared,
        apart=number in silhouettes.apart,
        covered=_is_covered(foreground, part.pixels, box, window),
        cut=_touches(foreground.missing, part.pixels, box),
        colour=(float(colour[0]), float(colour[1]), float(colour[2])),
    )
