"""Which silhouettes of an image show the tracked objects, and which show something else."""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.validation_gate import ValidationGate

FRAGMENT_PIXELS = 6
"""Fragments of a silhouette with fewer pixels are noise."""
FRAGMENT_SHARE = 0.25
"""A fragment with a smaller share of the pixels of the largest fragment is a piece of the same object."""
CLAIM_MARGIN = 2.0
"""Distance [px] by which a fragment may lie outside the gate of a window that claims it."""
COVERED = 0.08
"""Share of an object's window that the arm may cover before the centroid counts as wrong."""
LOCATED = 0.4
"""An object claims a share of a silhouette that shows others too if its position is known to this share of its
radius."""


class Silhouette(NamedTuple):
    """The silhouette of one object or several, which are merged.

    Attributes:
        pixels: uint8, 1 where it is.
        members: places in the list of windows of the objects that are expected in it.
    """

    pixels: np.ndarray
    members: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class ImageSilhouettes:
    """The silhouettes of one image.

    Attributes:
        foreground: of the image.
        windows: where objects are expected.
        box: rows and columns of the image that contain all silhouettes; the arrays below are of this size.
        expected: silhouettes that lie in windows.
        others: pixels of all others, uint8, 1 where they are.
        apart: places in ``windows`` of objects beside which another large fragment lies in their window.
        covered: places in ``windows`` of objects of which the arm covers a part, or the border cuts one off.
        beyond: those of the latter. The border is the border of the examined area, and the size of the object is known.
    """

    foreground: Foreground
    windows: Sequence[ValidationGate]
    box: tuple[slice, slice]
    expected: Sequence[Silhouette]
    others: Sequence[np.ndarray]
    apart: Set[int]
    covered: Set[int]
    beyond: Set[int]

    @cached_property
    def offset(self) -> np.ndarray:
        """Full-frame coordinates of the top left pixel of the box, shape (2,) [px]."""
        rows, columns = self.box
        u0, v0 = self.foreground.image_offset
        return read_only(np.array([u0 + columns.start, v0 + rows.start], float))


def find_silhouettes(
    foreground: Foreground, windows: Sequence[ValidationGate] = (), min_pixels: int = 25
) -> ImageSilhouettes:
    """Returns the silhouettes of one image.

    Args:
        foreground: silhouettes and moving pixels.
        windows: where objects are expected.
        min_pixels: least number of pixels of a silhouette in no window.
    """
    covered = _covered(foreground, windows)
    u0, v0, width, height = cv2.boundingRect(foreground.mask)
    box = slice(v0, v0 + height), slice(u0, u0 + width)
    if width == 0:
        return ImageSilhouettes(foreground, windows, box, (), (), frozenset(), covered, frozenset())
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(foreground.mask[box], connectivity=8)
    offset = np.array([u0 + foreground.image_offset[0], v0 + foreground.image_offset[1]], float)
    areas = statistics[:, cv2.CC_STAT_AREA].tolist()
    fragments = [label for label in range(1, count) if areas[label] >= FRAGMENT_PIXELS]
    claims: dict[int, list[int]] = {}
    for label in fragments:
        claimed = _claimed_by(statistics[label], offset, windows)
        located = [number for number in claimed if windows[number].std <= LOCATED * windows[number].radius]
        for number in located or claimed:
            claims.setdefault(number, []).append(label)
    # The arm may divide a silhouette: all fragments on both sides of it are of the object.
    own = {
        number: mine if number in covered else _joined(mine, statistics, offset, windows[number])
        for number, mine in claims.items()
    }
    owned = {label for mine in own.values() for label in mine}
    apart = frozenset(number for number, mine in claims.items() if set(mine) - owned)
    others = [
        _pixels_of(labels, {label}, count) for label in fragments if label not in owned and areas[label] >= min_pixels
    ]
    expected, beyond = [], set()
    pending = set(own)
    while pending:
        group = _sharing(pending.pop(), own)
        pending -= group
        whole = _pixels_of(labels, {label for number in group for label in own[number]}, count)
        expected.append(Silhouette(whole, tuple(sorted(group))))
        if foreground.border is not None and cv2.countNonZero(cv2.bitwise_and(whole, foreground.border[box])):
            beyond |= {number for number in group if windows[number].sized}
    return ImageSilhouettes(foreground, windows, box, expected, others, apart, covered | beyond, frozenset(beyond))


def _covered(foreground: Foreground, windows: Sequence[ValidationGate]) -> frozenset[int]:
    """Returns the indices of the windows of which the arm covers more than `COVERED`."""
    if foreground.hidden is None:
        return frozenset()
    offset = np.array(foreground.image_offset)
    return frozenset(
        number for number, window in enumerate(windows) if covered_share(foreground.hidden, offset, window) > COVERED
    )


def _pixels_of(labels: np.ndarray, wanted: Set[int], count: int) -> np.ndarray:
    """Returns an image that is 1 at the pixels of some of the ``count`` labels, uint8."""
    if len(wanted) == 1:
        return (labels == next(iter(wanted))).view(np.uint8)
    lookup = np.zeros(count, np.uint8)
    lookup[list(wanted)] = 1
    return lookup[labels]


def _sharing(number: int, claims: Mapping[int, Sequence[int]]) -> set[int]:
    """Returns the windows that share fragments with a given window, directly or through others, the given window
    included."""
    group, labels = {number}, set(claims[number])
    while True:
        more = {other for other, mine in claims.items() if other not in group and labels & set(mine)}
        if not more:
            return group
        group |= more
        labels.update(label for other in more for label in claims[other])


def _claimed_by(statistics: np.ndarray, offset: np.ndarray, windows: Sequence[ValidationGate]) -> list[int]:
    """Returns the indices of the windows that claim a fragment, from its row of component statistics."""
    left, top, width, height, pixels = statistics.tolist()
    u0, v0 = offset.tolist()
    left, top = left + u0, top + v0
    right, bottom = left + width - 1.0, top + height - 1.0
    found = []
    for number, window in enumerate(windows):
        outside = math.hypot(max(left - window.u, window.u - right, 0.0), max(top - window.v, window.v - bottom, 0.0))
        gate = 3.0 * window.std + CLAIM_MARGIN
        inner = math.hypot(0.5 * (left + right) - window.u, 0.5 * (top + bottom) - window.v)
        if outside <= gate or (pixels < window.pixels and inner <= window.radius + gate):
            found.append(number)
    return found


def _joined(mine: Sequence[int], statistics: np.ndarray, offset: np.ndarray, window: ValidationGate) -> list[int]:
    """Returns the fragments of a window that show its object: the nearest large fragment, and all small fragments.

    A second large fragment is another object, whose silhouette has just separated from the first silhouette.
    """
    if len(mine) == 1:
        return list(mine)
    pixels = statistics[mine, cv2.CC_STAT_AREA]
    large = [label for label, count in zip(mine, pixels) if count >= FRAGMENT_SHARE * pixels.max()]
    centres = statistics[large, :2] + 0.5 * (statistics[large, 2:4] - 1) + offset
    nearest = large[int(np.hypot(*(centres - (window.u, window.v)).T).argmin())]
    return [label for label in mine if label == nearest or label not in large]


def covered_share(hidden: np.ndarray, offset: np.ndarray, window: ValidationGate) -> float:
    """Returns the share of a window that a mask covers.

    Args:
        hidden: uint8 (h, w), 255 where the arm is, or where the image shows nothing.
        offset: full-frame coordinates of its top left pixel, shape (2,) [px].
        window: the window.
    """
    (width, height), (u0, v0) = window.extents.tolist(), offset.tolist()
    u, v = window.u - u0, window.v - v0
    left, right = max(round(u - 0.5 * width), 0), max(round(u + 0.5 * width) + 1, 0)
    top, bottom = max(round(v - 0.5 * height), 0), max(round(v + 0.5 * height) + 1, 0)
    view = hidden[top:bottom, left:right]
    return cv2.countNonZero(view) / view.size if view.size else 0.0
