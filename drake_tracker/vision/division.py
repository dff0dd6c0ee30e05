"""Divides a silhouette that shows several objects among the windows in which they are expected."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.object_window import ObjectWindow
from drake_tracker.vision.outline_fit import box_outline, fit_outlines, own_shares

OWN_SHARE = 0.2
"""An object of which a smaller share shows beside larger objects cannot be placed."""
REACH = 1.35
"""Pixels farther from a window's centre than this many radii belong to another object."""
OVERSIZE = 1.3
"""A region that is this many times as wide or high as its object shows another one too."""
HIDDEN_BEHIND = 0.3
"""An object whose centre is nearer than this many radii to that of another is hidden by it."""


class Part(NamedTuple):
    """The part of a silhouette that belongs to one object.

    Attributes:
        pixels: uint8, 1 where they are.
        centre: centroid of the object (u, v) [px], where it is not simply that of the pixels.
        shared: whether the silhouette shows other objects too.
    """

    pixels: np.ndarray
    centre: np.ndarray | None = None
    shared: bool = False


def divide(whole: np.ndarray, windows: Sequence[ObjectWindow], offset: np.ndarray) -> list[Part]:
    """Returns the parts of a silhouette that belong to the objects in its windows, one for each of them.

    The silhouette of a single object is its own, unless it is far larger than the object. Otherwise the objects are
    placed so that their outlines cover the silhouette as well as possible; each takes the pixels that are nearest to
    it. An object that hardly shows beside larger ones, or behind a nearer one, has no part: its place is not seen.

    Args:
        whole: the silhouette, uint8, 1 where it is.
        windows: the objects.
        offset: full-frame coordinates of the top left pixel, shape (2,) [px].
    """
    if len(windows) == 1 and not _is_too_large(whole, windows[0]):
        return [Part(whole)]
    visible = [k for k, window in enumerate(windows) if not any(_hides(other, window) for other in windows)]
    parts = [Part(np.zeros_like(whole), shared=True) for _ in windows]
    if len(windows) > 1 and len(visible) == 1:
        parts[visible[0]] = Part(whole, shared=True)
        return parts
    outlines = [box_outline(windows[k].edges) for k in visible]
    expected = [windows[k].centre - offset for k in visible]
    places = fit_outlines(whole, outlines, expected, [windows[k].std for k in visible])
    own = own_shares(whole, outlines, places)
    seen = [number for number in range(len(visible)) if own[number] >= OWN_SHARE]
    if not seen:
        return parts
    pixels = _nearest(whole, [windows[visible[number]] for number in seen], [places[number] for number in seen])
    for number, mine in zip(seen, pixels):
        parts[visible[number]] = Part(mine, places[number] + offset, shared=True)
    return parts


def _is_too_large(whole: np.ndarray, window: ObjectWindow) -> bool:
    """Returns whether a silhouette is far larger than the object of known size that is expected there."""
    _, _, width, height = cv2.boundingRect(whole)
    return window.settled and bool((np.array([width, height]) > OVERSIZE * window.extents + 4.0).any())


def _nearest(whole: np.ndarray, windows: Sequence[ObjectWindow], places: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Returns the pixels of a silhouette, uint8, that are nearest to each object, and not farther than `REACH`."""
    rows, columns = np.nonzero(whole)
    points = np.column_stack([columns, rows])
    distances = np.stack([np.linalg.norm(points - p, axis=1) / each.radius for p, each in zip(places, windows)])
    nearest = distances.argmin(axis=0)
    masks = [(nearest == number) & (distances[number] <= REACH) for number in range(len(windows))]
    return [_drawn(whole.shape, rows[mask], columns[mask]) for mask in masks]


def _hides(front: ObjectWindow, back: ObjectWindow) -> bool:
    """Returns whether one object stands before the centre of another one."""
    if front is back or (front.depth, front.track) >= (back.depth, back.track):
        return False
    distance = math.hypot(front.u - back.u, front.v - back.v)
    return distance < HIDDEN_BEHIND * max(front.radius, back.radius)


def _drawn(shape: tuple[int, ...], rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Returns a uint8 image that is 1 at the given pixels."""
    image = np.zeros(shape, np.uint8)
    image[rows, columns] = 1
    return image
