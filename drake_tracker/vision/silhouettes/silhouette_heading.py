"""The direction in which an object of known size lies, from its silhouettes.

While an object moves, its direction is that of its path. Once it stands, the path says little: the object may have
stopped just after a corner. Then its box is turned about the vertical until its outlines fit the silhouettes. The
extents of an outline along the axes of the image are the same for two directions, one on either side of such an axis;
the slant tells them apart.
"""

import cv2
import numpy as np

HEADINGS = np.radians(np.arange(0.0, 180.0, 3.0))
"""Directions that are tried [rad]. The box looks the same after half a turn."""
NEAR = 5
"""Directions up to this many places from the best one count as the same."""
CLEAR, MISFIT = 2.0, 3.0
"""A direction is found if every other one has a misfit that is at least ``CLEAR`` pixels larger (root of the sum of
squares), and if its own misfit is at most ``MISFIT`` pixels per image (root mean square). Chosen on nine random walks,
seeds 704 to 712, which no result uses."""


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
