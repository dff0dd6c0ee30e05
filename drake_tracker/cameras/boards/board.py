"""The role of a board in calibration, for every kind of board."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

LEAST_POINTS = 8
"""Fewest points of a board from which a view of it is used."""


@dataclass(frozen=True, eq=False)
class BoardShapes:
    """The black areas of a board, in its frame B; the rest is white.

    Attributes:
        rectangles: (n, 4): least x, least y, width and height [m].
        circles: (n, 3): x and y of the centre, radius [m].
    """

    rectangles: np.ndarray
    circles: np.ndarray

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the lower and the upper corner (2,) of all shapes [m]."""
        corners = np.vstack(
            [
                self.rectangles[:, :2],
                self.rectangles[:, :2] + self.rectangles[:, 2:],
                self.circles[:, :2] - self.circles[:, 2:],
                self.circles[:, :2] + self.circles[:, 2:],
            ]
        )
        return corners.min(axis=0), corners.max(axis=0)


class Board(Protocol):
    """A flat board with points that can be found in an image.

    Its frame B has x along the columns, y along the rows, and z into the board, so that the axes of a board seen from
    the front are parallel to the image's u, v.
    """

    @property
    def columns(self) -> int:
        """Number of columns, as ``--board`` counts them."""
        ...

    @property
    def rows(self) -> int:
        """Number of rows."""
        ...

    @property
    def square(self) -> float:
        """Distance at which the pattern repeats [m], or the unit of length."""
        ...

    @property
    def name(self) -> str:
        """The board in words."""
        ...

    @property
    def spacing(self) -> float:
        """Distance between neighbouring points of a row [m]."""
        ...

    def points(self) -> np.ndarray:
        """Returns p_BQ of the board's points, shape (n, 3) [m]."""
        ...

    def turns(self) -> list[np.ndarray]:
        """Returns the orders (n,) of the points in which a turned board is indistinguishable, first the order of
        `points`."""
        ...

    def find(self, image: np.ndarray) -> np.ndarray | None:
        """Returns the pixels (n, 2) of the points in a grey image (h, w), NaN for hidden points; None without a
        board."""
        ...

    def shapes(self) -> BoardShapes:
        """Returns the black areas of the board."""
        ...


class SquareGrid:
    """A board whose pattern repeats on a square grid, with one point in each place."""

    columns: int
    rows: int
    square: float

    @property
    def spacing(self) -> float:
        """Distance between neighbouring points of a row [m]."""
        return self.square

    def points(self) -> np.ndarray:
        """Returns p_BQ of the points (columns * rows, 3) [m], row by row."""
        y, x = np.mgrid[: self.rows, : self.columns]
        return self.square * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def neighbours(board: Board) -> np.ndarray:
    """Returns the pairs of points of a board that are ``board.spacing`` apart, as indices (n, 2)."""
    p_BQ = board.points()
    distances = np.linalg.norm(p_BQ[:, np.newaxis] - p_BQ, axis=2)
    pairs = np.argwhere(np.isclose(distances, board.spacing, rtol=1e-6))
    return pairs[pairs[:, 0] < pairs[:, 1]]


def grid_turns(columns: int, rows: int, *, half: bool, quarter: bool) -> list[np.ndarray]:
    """Returns the orders of the points of a grid, row by row, after turns that leave it as it is.

    Args:
        columns: number of points in a row.
        rows: number of rows.
        half: whether the grid looks the same after half a turn.
        quarter: whether it looks the same after a quarter of a turn.
    """
    order = np.arange(rows * columns).reshape(rows, columns)
    turns = range(4) if quarter else range(0, 4, 2) if half else range(1)
    return [np.rot90(order, turn).ravel() for turn in turns]


def as_seen_from_the_front(found: np.ndarray, p_BQ: np.ndarray, columns: int) -> np.ndarray:
    """Returns the points of a grid in an order that is not mirrored.

    Args:
        found: pixels (n, 2) of all points, row by row in some direction.
        p_BQ: the points (n, 3) [m].
        columns: number of points in a row.
    """
    fit = np.linalg.lstsq(np.column_stack([p_BQ[:, :2], np.ones(len(p_BQ))]), found, rcond=None)[0]
    if np.linalg.det(fit[:2]) > 0.0:
        return found
    return found.reshape(-1, columns, 2)[:, ::-1].reshape(-1, 2)


def enough_points(found: np.ndarray | None) -> bool:
    """Returns whether the points (n, 2) that were found, NaN where not, are enough and do not lie on a line."""
    if found is None:
        return False
    seen = found[np.isfinite(found).all(axis=1)]
    if len(seen) < LEAST_POINTS:
        return False
    spread = np.linalg.svd(seen - seen.mean(axis=0), compute_uv=False)
    return bool(spread[1] > 0.05 * spread[0])


def frontal_homography(found: np.ndarray, frontal: np.ndarray) -> np.ndarray | None:
    """Returns H (3, 3) from the image to the frontal picture, or None when the points do not determine it.

    Args:
        found: pixels of the corners in the image (n, 2).
        frontal: where they are in the frontal picture (n, 2) [px].
    """
    return cv2.findHomography(found, frontal)[0]


def refine_corners(
    image: np.ndarray,
    found: np.ndarray,
    H: np.ndarray,
    size: tuple[int, int],
    window: int,
    stop: tuple[int, int, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the refined pixels (n, 2) in the image, and the frontal picture.

    Each corner starts where it was found, not on the regular grid: the lens's distortion makes them differ. A corner
    that lies outside the picture stays as it is.

    Args:
        image: grey image (h, w).
        found: pixels of the corners in it (n, 2).
        H: see `frontal_homography`.
        size: width and height of the frontal picture [px].
        window: half the width of the window round a corner in it [px].
        stop: criterion of cv2.cornerSubPix.
    """
    picture = cv2.warpPerspective(image, H, size, borderMode=cv2.BORDER_REPLICATE)
    start = cv2.perspectiveTransform(found[:, np.newaxis].astype(float), H).astype(np.float32)
    inside = ((start >= 0.0) & (start < size)).all(axis=(1, 2))
    refined = found.astype(float)
    if inside.any():
        corners = cv2.cornerSubPix(picture, start[inside], (window, window), (-1, -1), stop)
        refined[inside] = cv2.perspectiveTransform(corners.reshape(-1, 1, 2).astype(float), np.linalg.inv(H))[:, 0]
    return refined, picture
