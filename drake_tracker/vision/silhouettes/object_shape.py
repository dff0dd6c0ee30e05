"""The size of a tracked object: a box that is learned from the extents of its silhouettes.

The box stands upright and points along the object's path. Its silhouette in any image follows from length, width and
height, and is linear in them: the extent of a projected box along an image direction is the sum of the extents of its
three edges. Two cameras measure four extents per pair of images, which determines the box by least squares.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only

HEADING_SPEED = 0.04
"""Speed above which the direction of travel is known well enough [m/s]."""
MEMORY = 240
"""Number of pairs of images that a shape remembers."""
SETTLED = 60
"""Number of pairs of images from which the dimensions are well known."""
SIZED = 15
"""Number from which the extents of the silhouettes are known for the direction in which the object was seen."""
PRIOR_WEIGHT = 0.3
"""Weight of the first guess of the dimensions, in pairs of images."""
SMALLEST = 0.01
"""Smallest dimension [m]."""
FILL = 0.8
"""First guess of the share of the box's silhouette that the object fills."""
HEADINGS = np.radians(np.arange(0.0, 180.0, 3.0))
"""Directions that are tried [rad]. The box looks the same after half a turn."""
NEAR = 5
"""Directions up to this many places from the best direction count as equal."""
CLEAR, MISFIT = 2.0, 3.0
"""A direction is found if every other one has a misfit that is at least ``CLEAR`` pixels larger (root of the sum of
squares), and if its own misfit is at most ``MISFIT`` pixels per image (root mean square). Chosen on nine random walks,
seeds 704 to 712, which no result uses."""


@dataclass(frozen=True, eq=False)
class ObjectShape(FrozenState):
    """Learned size of an object.

    Attributes:
        dimensions: length, width and height, shape (3,) [m].
        heading: direction of the length about W's z axis [rad].
        matrix: of the least-squares problem, shape (3, 3) [px^2/m^2].
        vector: of the least-squares problem, shape (3,) [px^2/m].
        fill: share of the box's silhouette that the object fills.
        count: number of pairs of images so far.
        resting: whether ``heading`` was seen while the object stood.
    """

    dimensions: np.ndarray
    heading: float
    matrix: np.ndarray
    vector: np.ndarray
    fill: float = FILL
    count: int = 0
    resting: bool = False

    @classmethod
    def guess(cls, jacobians: np.ndarray, extents: np.ndarray) -> Self:
        """Returns the shape of an object of which one pair of silhouettes is known: the cube that fits them best.

        Args:
            jacobians: as for `learned`.
            extents: as for `learned`.
        """
        a = np.abs(jacobians).sum(axis=2).ravel()
        b = np.asarray(extents, float).ravel()
        dimensions = np.full(3, max(float(a @ b / (a @ a)), SMALLEST))
        weight = PRIOR_WEIGHT * float(a @ a) / len(jacobians)
        return cls(read_only(dimensions), 0.0, read_only(weight * np.eye(3)), read_only(weight * dimensions))

    @property
    def settled(self) -> bool:
        """Whether the dimensions are well known."""
        return self.count >= SETTLED

    @property
    def sized(self) -> bool:
        """Whether the extents of its silhouettes are known, for the present direction of travel at least."""
        return self.count >= SIZED

    def part(self, axis: int, count: int) -> Self:
        """Returns the first guess of the shape of each of some objects that stand in a row.

        Args:
            axis: of the box, along which they stand: 0 or 1.
            count: number of objects.
        """
        dimensions = self.dimensions.copy()
        dimensions[axis] /= count
        weight = PRIOR_WEIGHT * float(np.trace(self.matrix)) / max(self.count, 1)
        return replace(
            self,
            dimensions=read_only(dimensions),
            matrix=read_only(weight * np.eye(3)),
            vector=read_only(weight * dimensions),
            count=0,
        )

    @property
    def edges(self) -> np.ndarray:
        """The three edges of the box in W as columns, shape (3, 3) [m]."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) * self.dimensions

    def turned(self, velocity: np.ndarray) -> Self:
        """Returns the shape with the heading of a velocity, shape (3,) [m/s], unless it is too slow to tell."""
        if np.hypot(velocity[0], velocity[1]) < HEADING_SPEED:
            return self
        return replace(self, heading=float(np.arctan2(velocity[1], velocity[0])), resting=False)

    def at_rest(self, jacobians: np.ndarray, extents: np.ndarray, slants: np.ndarray) -> Self:
        """Returns the shape of a standing object with the heading that its silhouettes show, if they show it clearly.

        Two headings half a turn apart look alike; the heading nearer to the present heading is chosen.

        Args:
            jacobians: as for `learned`.
            extents: as for `learned`.
            slants: slant of the silhouette in every image, shape (n,) [px].
        """
        found = silhouette_heading(self.dimensions, jacobians, extents, slants)
        if found is None:
            return self
        return replace(self, heading=self.heading + math.remainder(found - self.heading, math.pi), resting=True)

    def learned(self, jacobians: np.ndarray, extents: np.ndarray, pixels: np.ndarray) -> Self:
        """Returns the shape after one more pair of silhouettes that show the whole object.

        Args:
            jacobians: derivative of the pixel by the position, of every image, shape (n, 2, 3) [px/m].
            extents: extent of the silhouette along u and v in every image, shape (n, 2) [px].
            pixels: number of pixels of the silhouette in every image, shape (n,).
        """
        unit = self.edges / self.dimensions
        A = np.abs(jacobians @ unit).reshape(-1, 3)
        keep = 1.0 - 1.0 / MEMORY
        prior = 1.0 if self.count == 0 else keep
        matrix, vector = prior * self.matrix + A.T @ A, prior * self.vector + A.T @ extents.ravel()
        dimensions = np.maximum(np.linalg.solve(matrix, vector), SMALLEST)
        areas = np.array([outline_area(J @ (unit * dimensions)) for J in jacobians])
        weight = 1.0 / min(self.count + 2, MEMORY)
        fill = self.fill + weight * (float(np.mean(pixels / areas)) - self.fill)
        return replace(
            self,
            dimensions=read_only(dimensions),
            matrix=read_only(matrix),
            vector=read_only(vector),
            fill=fill,
            count=self.count + 1,
        )


def outline_area(edges: np.ndarray) -> float:
    """Returns the area [px^2] of the outline of a box whose three edges appear as the columns of (2, 3) [px]."""
    (a, b, c), (d, e, f) = edges.tolist()
    return float(abs(a * e - b * d) + abs(a * f - c * d) + abs(b * f - c * e))


def silhouette_heading(
    dimensions: np.ndarray, jacobians: np.ndarray, extents: np.ndarray, slants: np.ndarray
) -> float | None:
    """Returns the direction of the length of an upright box about W's z axis, between -1.5 and 181.5 degrees [rad].

    Returns None if the silhouettes fit no direction, or several.

    Args:
        dimensions: length, width and height of the box, shape (3,) [m].
        jacobians: derivative of the pixel by the position, of every image, shape (n, 2, 3) [px/m].
        extents: extent of the silhouette along u and v in every image, shape (n, 2) [px].
        slants: slant of the silhouette in every image, as from `polygon_slant`, shape (n,) [px].
    """
    c, s, zero = np.cos(HEADINGS), np.sin(HEADINGS), np.zeros_like(HEADINGS)
    turns = np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]]).transpose(2, 0, 1)
    edges = jacobians @ (turns * dimensions)[:, None]
    misfits = np.sum((np.abs(edges).sum(axis=-1) - extents) ** 2, axis=(1, 2))
    misfits += np.sum((outline_slant(edges) - slants) ** 2, axis=1)
    best, count = int(misfits.argmin()), len(HEADINGS)
    apart = (np.arange(count) - best) % count
    away = misfits[np.minimum(apart, count - apart) > NEAR].min()
    before, at, after = misfits[best - 1], misfits[best], misfits[(best + 1) % count]
    if np.sqrt(away) - np.sqrt(at) < CLEAR or at > len(jacobians) * MISFIT**2:
        return None
    # The lowest point of the parabola through the three misfits.
    offset = 0.5 * (before - after) / max(before - 2.0 * at + after, 1e-9)
    return float(HEADINGS[best] + offset * HEADINGS[1])


def polygon_slant(corners: np.ndarray) -> float:
    """Returns how an area lies across the axes of the image [px].

    This is the covariance of u and v over the root of the sum of their variances. It is zero for an area that lies
    along an axis, and positive for one from the upper left to the lower right.

    Args:
        corners: of its outline in order, shape (n, 1, 2) or (n, 2), float32 or int32 [px].
    """
    moments = cv2.moments(corners)
    total = moments["mu20"] + moments["mu02"]
    return float(moments["mu11"] / np.sqrt(moments["m00"] * total)) if moments["m00"] * total > 0.0 else 0.0


def outline_slant(edges: np.ndarray) -> np.ndarray:
    """Returns the slants of the outlines of boxes [px], shape (...).

    The outline of a box is made of three parallelograms, one for each pair of edges, that do not overlap. Its moments
    are the sums of theirs.

    Args:
        edges: the three edges of every box as they appear in the image, as columns, shape (..., 2, 3) [px].
    """
    # Edges that point to the right, in the order of their slopes.
    edges = np.where(edges[..., :1, :] < 0.0, -edges, edges)
    order = np.argsort(np.arctan2(edges[..., 1, :], edges[..., 0, :]), axis=-1)
    a, b, c = np.moveaxis(np.take_along_axis(edges, order[..., None, :], axis=-1), -1, 0)
    area, uu, uv, vv = 0.0, 0.0, 0.0, 0.0
    for p, q, centre in ((a, b, c), (a, c, b), (b, c, a)):
        each = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
        area = area + each
        # A parallelogram is displaced by half of the edge that it does not have.
        spread = [(p[..., i] * p[..., j] + q[..., i] * q[..., j]) / 12.0 for i, j in ((0, 0), (0, 1), (1, 1))]
        shift = [centre[..., i] * centre[..., j] / 4.0 for i, j in ((0, 0), (0, 1), (1, 1))]
        uu, uv, vv = (old + each * (x + y) for old, x, y in zip((uu, uv, vv), spread, shift))
    return uv / np.sqrt(np.maximum(area * (uu + vv), 1e-12))
