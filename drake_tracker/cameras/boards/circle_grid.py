"""Grids of black circles, symmetric and asymmetric."""

import dataclasses

import cv2
import numpy as np

from drake_tracker.cameras.boards.board import (
    BoardShapes,
    SquareGrid,
    as_seen_from_the_front,
    enough_points,
    grid_turns,
)
from drake_tracker.core.errors import DrakeTrackerError

RADIUS = 0.3
"""Radius of a circle, as a fraction of the distance to its nearest neighbour."""
_FINDER_WIDTH = 640
"""Width [px] to which a smaller image is enlarged for the finder."""


@dataclasses.dataclass(frozen=True)
class CircleGrid(SquareGrid):
    """Black circles in rows and columns. The grid looks the same after half a turn.

    The board's frame B has its origin at the centre of the first circle, see `board.Board`.

    Attributes:
        columns: circles along x.
        rows: circles along y.
        square: distance between the centres of neighbours [m], or the unit of length.

    Raises DrakeTrackerError when there are too few.
    """

    columns: int = 7
    rows: int = 5
    square: float = 0.03

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3:
            raise DrakeTrackerError(f"a grid of {self.columns} x {self.rows} circles is too small; 3 x 3 is the least")

    @property
    def name(self) -> str:
        """The board in words."""
        return f"grid of {self.columns} x {self.rows} circles"

    def turns(self) -> list[np.ndarray]:
        """Returns the orders of the points in which a turned board is indistinguishable."""
        return grid_turns(self.columns, self.rows, half=True, quarter=self.columns == self.rows)

    def find(self, image: np.ndarray) -> np.ndarray | None:
        """Returns the pixels (n, 2) of the centres in a grey image (h, w), or None."""
        return _find(image, self.columns, self.rows, cv2.CALIB_CB_SYMMETRIC_GRID, self.points())

    def shapes(self) -> BoardShapes:
        """Returns the black areas of the board."""
        return _circles(self.points(), self.square)


@dataclasses.dataclass(frozen=True)
class AsymmetricCircleGrid:
    """Black circles in which every second row is shifted by half the distance, as OpenCV's asymmetric grid.

    With an odd number of rows, no turn of the grid looks the same. The board's frame B has its origin at the centre of
    the first circle, see `board.Board`.

    Attributes:
        columns: circles in a row.
        rows: number of rows.
        square: distance between neighbouring rows [m]; two circles of a row are twice as far apart.

    Raises DrakeTrackerError when there are too few.
    """

    columns: int = 4
    rows: int = 11
    square: float = 0.02

    def __post_init__(self) -> None:
        if self.columns < 2 or self.rows < 4:
            raise DrakeTrackerError(
                f"an asymmetric grid of {self.columns} x {self.rows} circles is too small; 2 x 4 is the least"
            )

    @property
    def name(self) -> str:
        """The board in words."""
        return f"asymmetric grid of {self.columns} x {self.rows} circles"

    @property
    def spacing(self) -> float:
        """Distance between neighbouring points of a row [m]."""
        return 2.0 * self.square

    def points(self) -> np.ndarray:
        """Returns p_BQ of the centres (columns * rows, 3) [m], row by row."""
        y, x = np.mgrid[: self.rows, : self.columns]
        return self.square * np.column_stack([(2 * x + y % 2).ravel(), y.ravel(), np.zeros(x.size)])

    def turns(self) -> list[np.ndarray]:
        """Returns the orders of the points in which a turned board is indistinguishable."""
        return grid_turns(self.columns, self.rows, half=self.rows % 2 == 0, quarter=False)

    def find(self, image: np.ndarray) -> np.ndarray | None:
        """Returns the pixels (n, 2) of the centres in a grey image (h, w), or None."""
        return _find(image, self.columns, self.rows, cv2.CALIB_CB_ASYMMETRIC_GRID, self.points())

    def shapes(self) -> BoardShapes:
        """Returns the black areas of the board."""
        return _circles(self.points(), np.sqrt(2.0) * self.square)


def _circles(p_BQ: np.ndarray, distance: float) -> BoardShapes:
    radii = np.full(len(p_BQ), RADIUS * distance)
    return BoardShapes(np.zeros((0, 4)), np.column_stack([p_BQ[:, :2], radii]))


def _find(image: np.ndarray, columns: int, rows: int, flag: int, p_BQ: np.ndarray) -> np.ndarray | None:
    """Returns the pixels (n, 2) of the centres of a grid of circles, or None."""
    scale = max(1, round(_FINDER_WIDTH / max(image.shape)))
    if scale > 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    settings = cv2.SimpleBlobDetector_Params()
    settings.maxArea = image.size / (columns * rows)
    settings.minArea = 16.0
    settings.minDistBetweenBlobs = 4.0
    finder = cv2.SimpleBlobDetector_create(settings)
    found, centres = cv2.findCirclesGrid(image, (columns, rows), flags=flag, blobDetector=finder)
    if not found:
        found, centres = cv2.findCirclesGrid(
            image, (columns, rows), flags=flag | cv2.CALIB_CB_CLUSTERING, blobDetector=finder
        )
    if not found:
        return None
    pixels = (centres.reshape(-1, 2).astype(float) + 0.5) / scale - 0.5
    pixels = as_seen_from_the_front(pixels, p_BQ, columns)
    return pixels if enough_points(pixels) else None
