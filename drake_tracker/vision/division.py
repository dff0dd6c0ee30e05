"""Divides silhouettes that show several objects among these objects."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.object_window import ObjectWindow
from drake_tracker.vision.outline_fit import ImageView, box_outline, fit_outlines, own_shares

OWN_SHARE = 0.2
"""An object of which a smaller share shows beside larger objects cannot be placed."""
REACH = 1.35
"""Pixels farther from a window's centre than this many radii belong to another object."""
OVERSIZE = 1.3
"""A region that is this many times as wide or high as its object shows another one too."""
HIDDEN_BEHIND = 0.3
"""An object whose centre is nearer than this many radii to that of another is hidden by it."""


class Silhouette(NamedTuple):
    """The silhouette of one object or several, which are merged.

    Attributes:
        pixels: uint8, 1 where it is.
        offset: full-frame coordinates of the top left pixel, shape (2,) [px].
        members: places in the list of windows of the objects that are expected in it.
    """

    pixels: np.ndarray
    offset: np.ndarray
    members: tuple[int, ...]


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


def is_shared(silhouette: Silhouette, windows: Sequence[ObjectWindow]) -> bool:
    """Returns whether a silhouette shows several objects: those of its windows, or one that is too small for it."""
    if len(silhouette.members) != 1:
        return len(silhouette.members) > 1
    window = windows[silhouette.members[0]]
    _, _, width, height = cv2.boundingRect(silhouette.pixels)
    return window.settled and bool((np.array([width, height]) > OVERSIZE * window.extents + 4.0).any())


def place_merged(
    images: Sequence[tuple[Sequence[Silhouette], Sequence[ObjectWindow]]], covariances: Sequence[np.ndarray]
) -> list[dict[int, np.ndarray]]:
    """Returns where objects stand that share silhouettes, in each image: {place in the list of windows: (u, v) [px]}.

    The objects are placed so that their outlines cover the silhouettes of all images together as well as possible.

    Args:
        images: of each image the silhouettes and the windows, which are of the same objects in all images.
        covariances: of the position that is expected of each object, shape (m, m) [m^2].
    """
    places: list[dict[int, np.ndarray]] = [{} for _ in images]
    for group in _merged(images):
        members = sorted(group)
        views = [_view_of(silhouettes, windows, members) for silhouettes, windows in images]
        displacements = fit_outlines([view for view, _ in views], np.array([covariances[number] for number in members]))
        for found, (view, offset) in zip(places, views):
            moved = view.centres + np.einsum("kij,kj->ki", view.jacobians, displacements) + offset
            found.update(zip(members, moved))
    return places


def divide(
    silhouette: Silhouette, windows: Sequence[ObjectWindow], places: Mapping[int, np.ndarray]
) -> list[tuple[int, Part]]:
    """Returns the parts of a silhouette that belong to its objects, with their places in the list of windows.

    Each object takes the pixels that are nearest to it. One that hardly shows beside larger ones, or stands behind a
    nearer one, has no part: its place is not seen.

    Args:
        silhouette: the silhouette.
        windows: where all objects are expected.
        places: where those that share silhouettes stand, as from `place_merged`.
    """
    whole, offset, members = silhouette
    if not is_shared(silhouette, windows):
        return [(number, Part(whole)) for number in members]
    visible = [k for k in members if not any(_hides(windows[other], windows[k]) for other in members)]
    centres = [places[k] - offset for k in visible]
    own = own_shares(whole, [box_outline(windows[k].edges) for k in visible], centres)
    seen = [(k, centre) for k, centre, share in zip(visible, centres, own) if share >= OWN_SHARE]
    if not seen:
        return []
    pixels = _nearest(whole, [windows[k] for k, _ in seen], [centre for _, centre in seen])
    return [(k, Part(mine, places[k], shared=True)) for (k, _), mine in zip(seen, pixels)]


def _merged(images: Sequence[tuple[Sequence[Silhouette], Sequence[ObjectWindow]]]) -> list[set[int]]:
    """Returns the groups of objects that share silhouettes in any image, directly or through others."""
    groups: list[set[int]] = []
    for silhouettes, windows in images:
        for silhouette in silhouettes:
            if is_shared(silhouette, windows):
                mine = set(silhouette.members)
                for group in [each for each in groups if each & mine]:
                    groups.remove(group)
                    mine |= group
                groups.append(mine)
    return groups


def _view_of(
    silhouettes: Sequence[Silhouette], windows: Sequence[ObjectWindow], members: Sequence[int]
) -> tuple[ImageView, np.ndarray]:
    """Returns what an image shows of some objects, and full-frame coordinates of its top left pixel [px]."""
    mine = [each for each in silhouettes if set(each.members) & set(members)]
    whole = np.bitwise_or.reduce([each.pixels for each in mine]) if mine else np.zeros((1, 1), np.uint8)
    offset = mine[0].offset if mine else np.zeros(2)
    chosen = [windows[number] for number in members]
    view = ImageView(
        whole,
        [box_outline(window.edges) for window in chosen],
        np.array([window.centre - offset for window in chosen]),
        np.array([window.jacobian for window in chosen]),
    )
    return view, offset


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
