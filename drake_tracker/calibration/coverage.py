"""Which part of an image a board covered, over all photographs of a camera."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

CELLS = (6, 8)
"""Rows and columns of the cells into which the image is divided."""
LEAST_BOX = 0.2
"""Least area of the box round all points, as a fraction of the image; a lens is not determined outside of it."""


def covered_cells(views: Sequence[np.ndarray], shape: tuple[int, int]) -> np.ndarray:
    """Returns which cells of an image contain points of the board in any view, booleans of the shape `CELLS`.

    Args:
        views: points (n, 2) [px], NaN for hidden ones.
        shape: (h, w) of the images [px].
    """
    points = np.concatenate(views)
    u, v = points[np.isfinite(points).all(axis=1)].T
    counts, _, _ = np.histogram2d(v, u, bins=CELLS, range=[(-0.5, shape[0] - 0.5), (-0.5, shape[1] - 0.5)])
    return counts > 0


def check_coverage(spec: str, views: Sequence[np.ndarray], shape: tuple[int, int]) -> None:
    """Raises DrakeTrackerError when the board was in one part of the image only.

    Args:
        spec: the photographs, for the message.
        views: points (n, 2) [px], NaN for hidden ones.
        shape: (h, w) of the images [px].
    """
    points = np.concatenate(views)
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    share = float(np.prod(high - low)) / (shape[0] * shape[1])
    if share < LEAST_BOX:
        u, v = 0.5 * (low + high) / (shape[1], shape[0])
        across = "left" if u < 0.4 else "right" if u > 0.6 else "middle"
        down = "upper" if v < 0.4 else "lower" if v > 0.6 else "middle"
        where = "middle" if across == down else f"{down} {across}"
        raise DrakeTrackerError(
            f"{spec}: the board is in one part of the image only, the {where} ({100 * share:.0f} % of it); take "
            "photographs of it near all edges and corners of the image, and closer"
        )
