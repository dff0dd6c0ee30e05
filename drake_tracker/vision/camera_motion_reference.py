"""The edge pixels of a reference image, on which the motion of the camera is measured."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only

BLOCKS = 12
"""Number of squares along the longer side of the image. Edge pixels are selected in each square, so that all parts of
the image take part."""
PER_BLOCK, PER_BLOCK_CHECKED = 36, 12
"""Largest number of edge pixels in a square that a fit uses, and that the check for a still camera uses."""
MARGIN = 3
"""Pixels at the border of the image that are not used [px]."""
REACH = 1.5
"""Distance from an edge pixel to the places on either side whose difference is the contrast of the edge [px]."""
LEAST_POINTS = 60
"""Least number of edge pixels for a fit."""
LEAST_GRADIENT = 1.0
"""Least gradient of an edge pixel [grey levels/px]."""


class EdgePixels(NamedTuple):
    """Edge pixels of a reference image; every array is read-only.

    Attributes:
        points: (n, 2) places (u, v), float32 [px].
        levels: (n,) brightness of the smoothed reference [grey levels].
        columns: (n, 10) derivatives of the brightness by the eight parameters of the homography, in coordinates from -1
            to 1, and by gain and offset of the light.
        dark: (n, 2) places on the dark side of the edges, float32 [px].
        bright: (n, 2) places on their bright side, float32 [px].
        contrasts: (n,) differences of the brightness of the two, positive [grey levels].
        flat: (n, 3) indices of the three places in the flattened image.
    """

    points: np.ndarray
    levels: np.ndarray
    columns: np.ndarray
    dark: np.ndarray
    bright: np.ndarray
    contrasts: np.ndarray
    flat: np.ndarray

    def first(self, count: int) -> "EdgePixels":
        """Returns the first ``count`` of them."""
        return EdgePixels(*(array[:count] for array in self))

    def where(self, chosen: np.ndarray) -> "EdgePixels":
        """Returns those that are chosen, by booleans (n,)."""
        return EdgePixels(*(array[chosen] for array in self))


@dataclass(frozen=True)
class CameraReference(FrozenState):
    """Features of a reference image for a fit.

    Attributes:
        size: width and height of the image [px].
        factor: size of the image over that of the image in which edges were selected.
        edges: edge pixels for the fit.
        checked: the few of them for the check.
        to_unit: (3, 3) matrix from pixels of the smaller image to coordinates from -1 to 1.
        metric: (8, 8) matrix; ``p @ metric @ p`` is the mean square displacement [px^2] by small parameters ``p``.
        level: mean brightness of the edge pixels [grey levels].
        small: the smaller image itself, smoothed, uint8.
    """

    size: tuple[int, int]
    factor: int
    edges: EdgePixels
    checked: EdgePixels
    to_unit: np.ndarray
    metric: np.ndarray
    level: float
    small: np.ndarray

    @property
    def textured(self) -> bool:
        """Whether there are enough edge pixels for a fit."""
        return len(self.checked.points) >= LEAST_POINTS

    def without(self, mask: np.ndarray) -> "CameraReference":
        """Returns the reference without the edge pixels at which a mask, uint8 (h, w) of the full image, is not 0."""
        kept = []
        for edges in (self.edges, self.checked):
            u, v = (self.factor * edges.points).astype(np.intp).T
            kept.append(edges.where(mask[v, u] == 0))
        return replace(self, edges=kept[0], checked=kept[1])

    def full_size(self, transform: np.ndarray) -> np.ndarray:
        """Returns a transform (3, 3) of pixels of the smaller image as one of pixels of the full image."""
        f, c = float(self.factor), 0.5 * (self.factor - 1.0)
        grow = np.array([[f, 0.0, c], [0.0, f, c], [0.0, 0.0, 1.0]])
        full = grow @ transform @ np.linalg.inv(grow)
        return full / full[2, 2]

    def distance(self, warp0: np.ndarray, warp1: np.ndarray) -> float:
        """Returns the root mean square distance of the edge pixels after two warps (3, 3) [px]."""
        first, second = (cv2.perspectiveTransform(self.checked.points[np.newaxis], warp) for warp in (warp0, warp1))
        return float(np.sqrt(np.mean(np.sum((first - second) ** 2, axis=2))))


def prepare_image(image: np.ndarray, factor: int) -> np.ndarray:
    """Returns an image as the fit uses it: smaller by a whole ``factor``, and smoothed against noise."""
    if factor > 1:
        size = (image.shape[1] // factor, image.shape[0] // factor)
        image = cv2.resize(image[: factor * size[1], : factor * size[0]], size, interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(image, (3, 3), 0.8)


def prepare_reference(image: np.ndarray, largest_side: int) -> CameraReference:
    """Returns the `CameraReference` of a reference image.

    Args:
        image: the scene, grey uint8 (h, w).
        largest_side: longer side up to which the image is used at its own resolution [px].
    """
    height, width = image.shape
    factor = max(1, -(-max(height, width) // largest_side))
    small = read_only(prepare_image(image, factor))
    smooth = small.astype(np.float32)
    h, w = smooth.shape
    gu, gv = (cv2.Sobel(smooth, cv2.CV_32F, du, 1 - du, ksize=1, scale=0.5) for du in (1, 0))
    select = _select(cv2.magnitude(gu, gv))
    v, u = np.divmod(select, w)
    gu, gv = gu[v, u], gv[v, u]
    points = np.column_stack([u, v]).astype(np.float32)
    steps = np.rint(REACH * np.column_stack([gu, gv]) / np.maximum(np.hypot(gu, gv), 1e-6)[:, np.newaxis])
    dark, bright = points - steps.astype(np.float32), points + steps.astype(np.float32)
    flat = np.column_stack([places.astype(np.intp) @ [1, w] for places in (points, dark, bright)])
    levels, dark_levels, bright_levels = smooth.ravel()[flat].T
    contrasts = bright_levels - dark_levels
    keep = contrasts >= LEAST_GRADIENT
    s = 0.5 * max(h, w)
    to_unit = np.array([[1.0 / s, 0.0, -0.5 * (w - 1) / s], [0.0, 1.0 / s, -0.5 * (h - 1) / s], [0.0, 0.0, 1.0]])
    x, y = (points[:, 0] - 0.5 * (w - 1)) / s, (points[:, 1] - 0.5 * (h - 1)) / s
    along_u, along_v = _displacements(x, y)
    level = float(levels.mean()) if len(levels) else float(smooth.mean())
    J = s * (gu[:, np.newaxis] * along_u + gv[:, np.newaxis] * along_v)
    columns = np.column_stack([J, levels, np.full(len(levels), level)]).astype(np.float32)
    arrays = [array[keep] for array in (points, levels, columns, dark, bright, contrasts, flat)]
    edges = EdgePixels(*map(read_only, arrays))
    metric = (along_u[keep].T @ along_u[keep] + along_v[keep].T @ along_v[keep]) * s**2 / max(1, keep.sum())
    blocks = -(-len(select) // PER_BLOCK)
    checked = edges.first(int(keep[: blocks * PER_BLOCK_CHECKED].sum()))
    return CameraReference((width, height), factor, edges, checked, read_only(to_unit), read_only(metric), level, small)


def _select(gradient: np.ndarray) -> np.ndarray:
    """Returns the flat indices of the edge pixels: of each square its strongest, the strongest of all squares first."""
    h, w = gradient.shape
    side = max(4, -(-max(h, w) // BLOCKS))
    inner = np.zeros((-(-h // side) * side, -(-w // side) * side), np.float32)
    area = np.s_[MARGIN : h - MARGIN, MARGIN : w - MARGIN]
    inner[area] = gradient[area]
    index = np.arange(inner.size).reshape(inner.shape)
    rows, columns = inner.shape[0] // side, inner.shape[1] // side
    squares = [
        array.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(rows * columns, -1) for array in (inner, index)
    ]
    order = np.argsort(-squares[0], axis=1, kind="stable")[:, :PER_BLOCK]
    values, places = (np.take_along_axis(array, order, axis=1).T.ravel() for array in squares)
    places = places[values >= LEAST_GRADIENT]
    v, u = np.divmod(places, inner.shape[1])
    return v * w + u


def _displacements(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the derivatives (n, 8) of the two coordinates of points by the parameters of a homography."""
    one, zero = np.ones_like(x), np.zeros_like(x)
    along_u = np.column_stack([x, y, one, zero, zero, zero, -x * x, -x * y])
    along_v = np.column_stack([zero, zero, zero, x, y, one, -x * y, -y * y])
    return along_u, along_v
