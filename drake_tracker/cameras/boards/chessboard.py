"""A chessboard: its picture, and its corners in an image."""

import dataclasses

import cv2
import numpy as np

from drake_tracker.cameras.boards.board import (
    BoardShapes,
    SquareGrid,
    as_seen_from_the_front,
    frontal_homography,
    grid_turns,
    refine_corners,
)
from drake_tracker.core.errors import DrakeTrackerError

_FINDER_WIDTH, _LARGEST_FINDER_WIDTH = 1024, 1800
"""Width to which a small image is enlarged, and a large image reduced, to find the board [px]."""
_FRONTAL_SQUARE, _LARGEST_FRONTAL_SQUARE = 24, 96
"""Least and greatest side of a square in the frontal picture, in which the corners are refined [px]."""
_REFINE_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-4)

_WHITE = 180
_BLACK = 8
_TEXELS = 40
"""Texels along the side of a square."""
_SOFTNESS = 0.08
"""Standard deviation of the blur of a square's edge, in sides of a square."""


@dataclasses.dataclass(frozen=True)
class Chessboard(SquareGrid):
    """A chessboard of (columns + 1) x (rows + 1) squares.

    The board's frame B has its origin at the first inner corner, x along the columns, y along the rows, and z into the
    board, so that the axes of a board seen from the front are parallel to the image's u, v. If one of both numbers is
    odd and one even, the square diagonally outside the first inner corner is black. Otherwise the board looks the same
    after half a turn, and either end may be the first.

    Attributes:
        columns: inner corners along x.
        rows: inner corners along y.
        square: side of a square [m], or the unit of length.

    Raises DrakeTrackerError when there are too few.
    """

    columns: int = 9
    rows: int = 6
    square: float = 0.05

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3:
            raise DrakeTrackerError(
                f"a board of {self.columns} x {self.rows} inner corners cannot be used; both must be at least 3"
            )

    @property
    def name(self) -> str:
        """The board in words."""
        return f"{self.columns} x {self.rows} board"

    def turns(self) -> list[np.ndarray]:
        """Returns the orders of the corners in which a turned board looks the same."""
        half = (self.columns + self.rows) % 2 == 0
        return grid_turns(self.columns, self.rows, half=half, quarter=self.columns == self.rows)

    def find(self, image: np.ndarray) -> np.ndarray | None:
        """Returns the pixels (n, 2) of the inner corners in a grey image (h, w), or None."""
        return find_corners(image, self)

    def shapes(self) -> BoardShapes:
        """Returns the black areas of the board."""
        y, x = np.mgrid[-1 : self.rows, -1 : self.columns]
        black = (x + y) % 2 == 0
        squares = np.column_stack([x[black], y[black], np.ones((black.sum(), 2))]) * self.square
        return BoardShapes(squares, np.zeros((0, 3)))


def draw_board(board: Chessboard) -> np.ndarray:
    """Returns the picture of a board with a white margin of one square, as grey levels, uint8 (h, w).

    The renderer takes one sample per pixel, so that sharp edges become jagged, which shifts the corners. The edges here
    are as soft as a lens would make them.
    """
    y, x = np.mgrid[: board.rows + 3, : board.columns + 3] - 2
    inside = (x >= -1) & (x < board.columns) & (y >= -1) & (y < board.rows)
    grey = np.where(inside & ((x + y) % 2 == 0), _BLACK, _WHITE).astype(np.uint8)
    picture = np.kron(grey, np.ones((_TEXELS, _TEXELS), np.uint8))
    return cv2.GaussianBlur(picture, (0, 0), _SOFTNESS * _TEXELS, borderType=cv2.BORDER_REPLICATE)


def find_corners(image: np.ndarray, board: Chessboard) -> np.ndarray | None:
    """Returns the pixels (columns * rows, 2) of a board's inner corners in a grey image (h, w), or None.

    The order is the order of `Chessboard.points`. If the colours of the squares allow, they distinguish the two ends of
    the board. The corners are refined in a frontal picture of the board (`board.refine_corners`).
    """
    # The finder needs squares of about 20 px, for which a small image is enlarged. It is slow in a large one.
    scale: float = max(1, round(_FINDER_WIDTH / max(image.shape)))
    if max(image.shape) > _LARGEST_FINDER_WIDTH:
        scale = _LARGEST_FINDER_WIDTH / max(image.shape)
    method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
    resized = cv2.resize(image, None, fx=scale, fy=scale, interpolation=method)
    found, corners = cv2.findChessboardCorners(
        resized, (board.columns, board.rows), flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    )
    if not found:
        return None
    corners = (corners.reshape(-1, 2).astype(float) + 0.5) / scale - 0.5
    steps = np.linalg.norm(np.diff(corners.reshape(board.rows, board.columns, 2), axis=1), axis=2)
    step = float(np.median(steps))
    side = _FRONTAL_SQUARE if step < 2.0 * _FRONTAL_SQUARE else min(int(step), _LARGEST_FRONTAL_SQUARE)
    frontal = side * (board.points()[:, :2] / board.square + 2.0)
    H = frontal_homography(corners, frontal)
    if H is None:
        return None
    size = (side * (board.columns + 3), side * (board.rows + 3))
    corners, picture = refine_corners(image, corners, H, size, side // 3, _REFINE_STOP)
    if len(board.turns()) > 1:
        return as_seen_from_the_front(corners, board.points(), board.columns)
    return corners if _first_square_is_black(picture, board, side) else corners[::-1].copy()


def _first_square_is_black(picture: np.ndarray, board: Chessboard, side: int) -> bool:
    """Returns whether a frontal picture with squares of ``side`` px is the right way round, not half a turn off."""
    y, x = np.mgrid[: board.rows - 1, : board.columns - 1]
    v, u = ((np.array([y, x]) + 2.5) * side).astype(int)
    grey = picture[v, u].astype(float)
    black = (x + y) % 2 == 0
    return bool(grey[black].mean() < grey[~black].mean())
