"""Where objects of known size stand whose silhouettes are merged.

Each object appears as the outline of its box. The outlines are placed so that they cover the silhouettes and little
else: one object after the other is moved to the place where it explains most pixels, given the others, until none
moves. All images count together, because an object has one position: where it is hidden in one image, another decides.
Pixels that the robot's arm covers count neither for nor against a place.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.vision.subpixel_peak import peak_offset

ROUNDS = 6
"""How often every object is moved at most."""
FIRST_REACH, REACH = 8, 3
"""How far an object is moved at a time in either direction, in the first round and later [px]."""
PULL = 0.15
"""Loss of pixels, as a share of the outline's, that an object accepts to be a standard deviation nearer to where it is
expected."""
LEAST_STD = 1.0
"""No expectation is taken to be better than this [px]."""
LARGEST = 1000
"""Largest distance of an outline from its centre [px]: the outline of an object close to a camera would have no
bounds."""
STEADY = 0.05
"""Objects whose outlines move less than this [px] have found their places."""


class ImageView(NamedTuple):
    """One image of n objects.

    Attributes:
        silhouette: uint8 (h, w), 1 where it is; 0 where none of the objects is seen.
        empty: uint8 (h, w), 1 where the image shows that no object is; None if that is all but the silhouette.
        outlines: of each object, as from `box_outline`.
        centres: where each object is expected, shape (n, 2) [px].
        jacobians: how an object moves in the image with its position, shape (n, 2, m) [px/m].
    """

    silhouette: np.ndarray
    empty: np.ndarray | None
    outlines: Sequence[np.ndarray]
    centres: np.ndarray
    jacobians: np.ndarray


def box_outline(edges: np.ndarray) -> np.ndarray:
    """Returns the corners of the outline of a box about its centre, shape (n, 2) [px].

    Args:
        edges: the three edges of the box as they appear in the image, as columns, shape (2, 3) [px].
    """
    signs = np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])
    return cv2.convexHull((signs @ edges.T).astype(np.float32))[:, 0]


def fit_outlines(views: Sequence[ImageView], covariances: np.ndarray) -> np.ndarray:
    """Returns by how much objects are displaced from where they are expected, shape (n, m) [m].

    Args:
        views: one or several images of the same n objects.
        covariances: of the expected positions, shape (n, m, m) [m^2].
    """
    borders = [_Border.about(view) for view in views]
    found = np.zeros(covariances.shape[:2])
    precisions = [_precision(views, covariance, k) for k, covariance in enumerate(covariances)]
    for turn in range(ROUNDS):
        reach = FIRST_REACH if turn == 0 else REACH
        moved = 0.0
        for k, precision in enumerate(precisions):
            place = _best_place(borders, k, found, precision, reach)
            moved = max(moved, *(float(np.abs(view.jacobians[k] @ (place - found[k])).max()) for view in views))
            found[k] = place
        if moved < STEADY:
            break
    return found


def own_shares(silhouette: np.ndarray, outlines: Sequence[np.ndarray], centres: Sequence[np.ndarray]) -> list[float]:
    """Returns which share of each outline covers pixels of the silhouette that no larger outline covers.

    Args:
        silhouette: uint8 (h, w), 1 where it is.
        outlines: of each object, as from `box_outline`.
        centres: of each object, shape (2,) [px].
    """
    areas = [cv2.contourArea(outline) for outline in outlines]
    rest, shares = silhouette.copy(), [0.0] * len(outlines)
    for k in sorted(range(len(outlines)), key=lambda k: -areas[k]):
        mask = np.zeros_like(silhouette)
        corners = np.rint((outlines[k] + centres[k]) * 16.0).astype(np.int32)
        cv2.fillConvexPoly(mask, corners, 1, lineType=cv2.LINE_8, shift=4)
        shares[k] = cv2.countNonZero(cv2.bitwise_and(mask, rest)) / max(areas[k], 1.0)
        rest = cv2.subtract(rest, mask)
    return shares


class _Border(NamedTuple):
    """A view with a border around its silhouette, so that every outline can be moved about in it.

    Attributes:
        view: the view.
        silhouette: with the border.
        empty: the same of the view's, or None.
        width: of the border [px].
        templates: the outlines, filled.
        known: what `covered` has returned, by all that it depends on. From some round on, no object moves by a pixel.
    """

    view: ImageView
    silhouette: np.ndarray
    empty: np.ndarray | None
    width: int
    templates: Sequence[np.ndarray]
    known: dict[tuple[tuple[int, int], ...], np.ndarray]

    @classmethod
    def about(cls, view: ImageView) -> "_Border":
        """Returns a view with its border."""
        templates = [_template(outline) for outline in view.outlines]
        width = max(max(template.shape) for template in templates) + FIRST_REACH
        around = (width, width, width, width, cv2.BORDER_CONSTANT)
        silhouette = cv2.copyMakeBorder(view.silhouette, *around)
        empty = None if view.empty is None else cv2.copyMakeBorder(view.empty, *around)
        return cls(view, silhouette, empty, width, templates, {})

    def pixel(self, k: int, displacement: np.ndarray) -> tuple[int, int]:
        """Returns the pixel (u, v) at the centre of a displaced object, not outside the image."""
        height, width = self.view.silhouette.shape
        u, v = (self.view.centres[k] + self.view.jacobians[k] @ displacement).tolist()
        # As in rint, halves are rounded to the even number, which depends on the border.
        return (
            round(min(max(u, 0.0), width - 1.0) + self.width),
            round(min(max(v, 0.0), height - 1.0) + self.width),
        )

    def covered(self, k: int, displacements: np.ndarray, reach: int) -> tuple[np.ndarray, tuple[int, int]]:
        """Returns the covered area of an object for displacements up to ``reach`` pixels, and the first pixel.

        A pixel that no other object covers counts twice, and a pixel that is known to be empty is subtracted. The
        result has shape (2 r + 1,) * 2 and begins at the pixel (u, v).
        """
        pixels = [self.pixel(each, displacement) for each, displacement in enumerate(displacements)]
        first = pixels[k][0] - reach, pixels[k][1] - reach
        key = ((k, reach), *pixels)
        if key not in self.known:
            self.known[key] = self._covered(k, pixels, reach)
        return self.known[key], first

    def _covered(self, k: int, pixels: Sequence[tuple[int, int]], reach: int) -> np.ndarray:
        """Returns the covered area of an object, as in `covered`, with the centres of all objects at given pixels."""
        alone = self.silhouette
        if len(pixels) > 1:
            alone = alone.copy()
            for other, template in enumerate(self.templates):
                if other != k:
                    _erase(alone, template, pixels[other])
        template = self.templates[k]
        height, width = template.shape
        left, top = pixels[k][0] - reach - width // 2, pixels[k][1] - reach - height // 2
        near = slice(top, top + height + 2 * reach), slice(left, left + width + 2 * reach)
        covered = cv2.matchTemplate(cv2.add(alone[near], self.silhouette[near]), template, cv2.TM_CCORR)
        return covered if self.empty is None else covered - cv2.matchTemplate(self.empty[near], template, cv2.TM_CCORR)


def _precision(views: Sequence[ImageView], covariance: np.ndarray, k: int) -> np.ndarray:
    """Returns the weight of an object's displacement, squared, in pixels of its outlines, shape (m, m) [px/m^2]."""
    scale = np.mean([np.abs(view.jacobians[k] @ view.jacobians[k].T).max() for view in views])
    area = sum(cv2.contourArea(view.outlines[k]) for view in views if view.silhouette.any())
    return PULL * area * np.linalg.inv(covariance + LEAST_STD**2 / scale * np.eye(len(covariance)))


def _best_place(
    borders: Sequence[_Border], k: int, displacements: np.ndarray, precision: np.ndarray, reach: int
) -> np.ndarray:
    """Returns the displacement of an object, near its present one, in which it covers most, shape (m,) [m]."""
    start = displacements[k]
    steps, step = _steps(borders, k, reach, len(start))
    trials = start + steps.reshape(-1, len(start))
    total = -np.einsum("ni,ij,nj->n", trials, precision, trials)
    for border in borders:
        covered, first = border.covered(k, displacements, reach + 1)
        places = border.view.centres[k] + trials @ border.view.jacobians[k].T + border.width
        places -= first
        total += _interpolated(covered, places)
    total = total.reshape(steps.shape[:-1])
    best = np.unravel_index(int(total.argmax()), total.shape)
    place = start + steps[best]
    for axis in range(len(start)):
        line = np.moveaxis(total, axis, 0)[(slice(None), *(index for other, index in enumerate(best) if other != axis))]
        place[axis] += step * peak_offset(line, int(best[axis]))
    return place


def _steps(borders: Sequence[_Border], k: int, reach: int, size: int) -> tuple[np.ndarray, float]:
    """Returns the trial steps of an object on a grid, shape (..., m) [m], and the width of the grid [m].

    The grid reaches ``reach`` pixels in the plane, and a single pixel upwards and downwards.
    """
    step = 1.0 / math.sqrt(max(float(np.square(border.view.jacobians[k]).sum(axis=0).max()) for border in borders))
    return step * _grid((reach, reach, 1)[:size]), step


@cache
def _grid(reaches: tuple[int, ...]) -> np.ndarray:
    """Returns all whole numbers up to some reaches in either direction, shape (2 r + 1, ..., m)."""
    axes = [np.arange(-reach, reach + 1) for reach in reaches]
    return read_only(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))


def _interpolated(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Returns values between pixels, bilinearly, shape (n,).

    Args:
        values: shape (h, w).
        places: u and v, shape (n, 2) [px]; those outside get the nearest value.
    """
    columns, rows = places.T.astype(np.float32)[:, None]
    return cv2.remap(values, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0]


def _template(outline: np.ndarray) -> np.ndarray:
    """Returns an outline filled with 1, uint8, of odd width and height, with its centre in the middle."""
    outline = np.clip(outline, -LARGEST, LARGEST)
    half_width, half_height = (math.ceil(float(np.abs(outline[:, axis]).max())) for axis in (0, 1))
    template = np.zeros((2 * half_height + 1, 2 * half_width + 1), np.uint8)
    corners = np.rint((outline + (half_width, half_height)) * 16.0).astype(np.int32)
    cv2.fillConvexPoly(template, corners, 1, lineType=cv2.LINE_8, shift=4)
    return template


def _erase(image: np.ndarray, template: np.ndarray, pixel: tuple[int, int]) -> None:
    """Sets the pixels under a template to 0 whose centre is at a pixel."""
    height, width = template.shape
    left, top = pixel[0] - width // 2, pixel[1] - height // 2
    view = image[top : top + height, left : left + width]
    np.multiply(view, 1 - template, out=view)
