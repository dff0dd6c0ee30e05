"""Places objects that do not show as a whole, and divides silhouettes that show several objects among them."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.silhouettes.outline_fit import ImageView, box_outline, fit_outlines, own_shares
from drake_tracker.vision.silhouettes.silhouettes import ImageSilhouettes, Silhouette
from drake_tracker.vision.silhouettes.validation_gate import ValidationGate

OWN_SHARE = 0.2
"""An object of which a smaller share shows beside larger objects cannot be placed."""
REACH = 1.35
"""Pixels farther from a window's centre than this many radii belong to another object."""
OVERSIZE = 1.3
"""A region that is this many times as wide or high as its object shows another one too."""
HIDDEN_BEHIND = 0.3
"""An object whose centre is nearer than this many radii to the centre of another object is occluded by it."""


class Part(NamedTuple):
    """The part of a silhouette that belongs to one object.

    Attributes:
        pixels: uint8, 1 where they are.
        centre: centroid of the object (u, v) [px], where it differs from the centroid of the pixels.
        shared: whether the silhouette shows other objects too.
    """

    pixels: np.ndarray
    centre: np.ndarray | None = None
    shared: bool = False


def is_shared(silhouette: Silhouette, windows: Sequence[ValidationGate]) -> bool:
    """Returns whether a silhouette shows several objects: the objects of its windows, or an object that is too small
    for the silhouette."""
    if len(silhouette.members) != 1:
        return len(silhouette.members) > 1
    window = windows[silhouette.members[0]]
    if not window.settled:
        return False
    _, _, width, height = cv2.boundingRect(silhouette.pixels)
    expected_width, expected_height = window.extents.tolist()
    return width > OVERSIZE * expected_width + 4.0 or height > OVERSIZE * expected_height + 4.0


def place_objects(images: Sequence[ImageSilhouettes], covariances: Sequence[np.ndarray]) -> list[dict[int, np.ndarray]]:
    """Returns where objects stand that share a silhouette or are covered by the arm in any of the images.

    The objects are placed so that their outlines cover the silhouettes of all images together as well as possible.

    Args:
        images: silhouettes of each image, with the windows of the same objects.
        covariances: of the position that is expected of each object, shape (m, m) [m^2].

    Returns, of each image, {place in the list of windows: (u, v) [px]}.
    """
    places: list[dict[int, np.ndarray]] = [{} for _ in images]
    for group in _groups(images):
        members = sorted(group)
        views = [_view_of(image, members) for image in images]
        displacements = fit_outlines([view for view, _ in views], np.array([covariances[k] for k in members]))
        for found, (view, offset) in zip(places, views):
            moved = view.centres + np.einsum("kij,kj->ki", view.jacobians, displacements) + offset
            found.update(zip(members, moved))
    return places


def divide(image: ImageSilhouettes, silhouette: Silhouette, places: Mapping[int, np.ndarray]) -> list[tuple[int, Part]]:
    """Returns the parts of a silhouette that belong to its objects, with their places in the list of windows.

    Each object takes the pixels that are nearest to it. An object that hardly shows beside larger objects, or stands
    behind a nearer object, gets no part: its place is not seen.

    Args:
        image: all silhouettes of the image.
        silhouette: one of them.
        places: where objects stand that do not show as a whole, as from `place_objects`.
    """
    (whole, members), windows, offset = silhouette, image.windows, image.offset
    if not is_shared(silhouette, windows):
        return [(k, Part(whole, places[k] if k in image.covered else None)) for k in members]
    visible = [k for k in members if not any(_hides(windows[other], windows[k]) for other in members)]
    centres = [places[k] - offset for k in visible]
    own = own_shares(whole, [box_outline(windows[k].edges) for k in visible], centres)
    seen = [(k, centre) for k, centre, share in zip(visible, centres, own) if share >= OWN_SHARE]
    if not seen:
        return []
    pixels = _nearest(whole, [windows[k] for k, _ in seen], [centre for _, centre in seen])
    return [(k, Part(mine, places[k], shared=True)) for (k, _), mine in zip(seen, pixels)]


def _groups(images: Sequence[ImageSilhouettes]) -> list[set[int]]:
    """Returns the groups of objects that must be placed together: they share silhouettes, directly or through others.

    A partly covered object is placed too, together with the objects that share its silhouette.
    """
    groups: list[set[int]] = []
    for image in images:
        for silhouette in image.expected:
            mine = set(silhouette.members)
            if is_shared(silhouette, image.windows) or mine & image.covered:
                for group in [each for each in groups if each & mine]:
                    groups.remove(group)
                    mine |= group
                groups.append(mine)
    return groups


def _view_of(image: ImageSilhouettes, members: Sequence[int]) -> tuple[ImageView, np.ndarray]:
    """Returns the part of an image around some objects, and the full-frame coordinates of its top left pixel [px]."""
    mine = [each.pixels for each in image.expected if set(each.members) & set(members)]
    whole = np.bitwise_or.reduce(mine) if mine else np.zeros((1, 1), np.uint8)
    offset, empty = image.offset, None
    unseen = image.foreground.unseen
    if unseen is not None and image.covered & set(members):
        # Under the arm and beyond the border, nothing is known. Elsewhere, pixels of no silhouette show that no object
        # is there.
        box, offset = whole, np.array(image.foreground.image_offset, float)
        whole = np.zeros_like(unseen)
        if mine:
            whole[image.box] = box
        empty = ((image.foreground.mask == 0) & (unseen == 0)).view(np.uint8)
    windows = [image.windows[number] for number in members]
    view = ImageView(
        whole,
        empty,
        [box_outline(window.edges) for window in windows],
        np.array([window.centre - offset for window in windows]),
        np.array([window.jacobian for window in windows]),
    )
    return view, offset


def _nearest(whole: np.ndarray, windows: Sequence[ValidationGate], places: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Returns the pixels of a silhouette, uint8, that are nearest to each object, and not farther than `REACH`."""
    rows, columns = np.nonzero(whole)
    points = np.column_stack([columns, rows])
    distances = np.stack([np.linalg.norm(points - p, axis=1) / each.radius for p, each in zip(places, windows)])
    nearest = distances.argmin(axis=0)
    masks = [(nearest == number) & (distances[number] <= REACH) for number in range(len(windows))]
    return [_drawn(whole.shape, rows[mask], columns[mask]) for mask in masks]


def _hides(front: ValidationGate, back: ValidationGate) -> bool:
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
