"""Boards with coded markers, of which a part is enough: ChArUco boards, and grids of AprilTags."""

import dataclasses
from functools import cached_property

import cv2
import numpy as np

from drake_tracker.cameras.boards.board import (
    BoardShapes,
    SquareGrid,
    enough_points,
    frontal_homography,
    neighbours,
    refine_corners,
)
from drake_tracker.core.errors import DrakeTrackerError

FAMILIES = {"4x4": "DICT_4X4", "5x5": "DICT_5X5", "6x6": "DICT_6X6", "7x7": "DICT_7X7"}
"""Families of ArUco markers, of which the smallest dictionary with enough markers is used."""
TAGS = "DICT_APRILTAG_36h11"
_SIZES = (50, 100, 250, 1000)
_TAG_CELLS = 8
"""Cells along the side of an AprilTag 36h11, its border included."""
_WINDOW = 0.75
"""Half the width of the window in which a corner is refined, in cells of a tag."""
_FARTHEST = 0.5
"""Largest median distance of corners from their places on a plane, in sides of a tag; a lens bends by less."""
_FRONTAL_SQUARE = (40, 96)
"""Least and greatest side of a square in the frontal picture, in which the corners are refined [px]."""
_REFINE_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)


@dataclasses.dataclass(frozen=True)
class CharucoBoard(SquareGrid):
    """A chessboard with an ArUco marker in each white square, in OpenCV's layout (4.6 and later).

    The board's frame B has its origin at the first inner corner, see `board.Board`.

    Attributes:
        columns: squares along x.
        rows: squares along y.
        square: side of a square [m], or the unit of length.
        marker: side of a marker [m]; None is three quarters of a square.
        family: of the markers, one of `FAMILIES`.

    Raises DrakeTrackerError when there are too few squares, too many markers, or the marker does not fit.
    """

    columns: int = 8
    rows: int = 6
    square: float = 0.03
    marker: float | None = None
    family: str = "4x4"

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 4:
            raise DrakeTrackerError(
                f"a ChArUco board of {self.columns} x {self.rows} squares is too small; 4 x 4 is the least"
            )
        if not 0.2 * self.square <= self.side < self.square:
            raise DrakeTrackerError(
                f"a marker of {self.side:g} m does not suit squares of {self.square:g} m; it must be smaller than a "
                "square, and at least a fifth of it"
            )
        _dictionary(self.family, self.columns * self.rows // 2)

    @property
    def name(self) -> str:
        """The board in words."""
        return f"ChArUco board of {self.columns} x {self.rows} squares"

    @property
    def side(self) -> float:
        """Side of a marker [m]."""
        return 0.75 * self.square if self.marker is None else self.marker

    def points(self) -> np.ndarray:
        """Returns p_BQ of the inner corners ((columns - 1) * (rows - 1), 3) [m], row by row."""
        y, x = np.mgrid[: self.rows - 1, : self.columns - 1]
        return self.square * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

    def turns(self) -> list[np.ndarray]:
        """Returns the order of the points: no turn of the board looks the same."""
        return [np.arange((self.columns - 1) * (self.rows - 1))]

    def find(self, image: np.ndarray) -> np.ndarray | None:
        """Returns the pixels (n, 2) of the inner corners in a grey image (h, w), NaN for hidden ones, or None."""
        corners, ids, _, _ = cv2.aruco.CharucoDetector(self._opencv).detectBoard(image)
        if ids is None or not len(ids):
            return None
        found = np.full((len(self.points()), 2), np.nan)
        found[ids.ravel()] = corners.reshape(-1, 2)
        if not enough_points(found):
            return None
        # OpenCV 4 places the corners half a pixel off. Within the gaps round the markers there is only the corner.
        pairs, seen = neighbours(self), ids.ravel()
        longest = np.nanmax(np.linalg.norm(found[pairs[:, 0]] - found[pairs[:, 1]], axis=1), initial=0.0)
        side = int(np.clip(longest, *_FRONTAL_SQUARE))
        H = frontal_homography(found[seen], side * (self.points()[seen, :2] / self.square + 2.0))
        if H is None:
            return None
        size = (side * (self.columns + 2), side * (self.rows + 2))
        window = max(2, int(0.5 * (1.0 - self.side / self.square) * side))
        found[seen], _ = refine_corners(image, found[seen], H, size, window, _REFINE_STOP)
        return found

    def shapes(self) -> BoardShapes:
        """Returns the black areas of the board."""
        y, x = np.mgrid[: self.rows, : self.columns]
        markers = np.array(self._opencv.getObjPoints())[:, :, :2]
        middles = np.floor(markers.mean(axis=1) / self.square).astype(int)
        black = np.ones((self.rows, self.columns), dtype=bool)
        black[middles[:, 1], middles[:, 0]] = False
        squares = np.column_stack([x[black] - 1, y[black] - 1, np.ones((black.sum(), 2))]) * self.square
        cells = _marker_cells(self._opencv, markers - self.square)
        return BoardShapes(np.vstack([squares, cells]), np.zeros((0, 3)))

    @cached_property
    def _opencv(self) -> cv2.aruco.CharucoBoard:
        dictionary = _dictionary(self.family, self.columns * self.rows // 2)
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.side, dictionary)


@dataclasses.dataclass(frozen=True)
class AprilTagGrid(SquareGrid):
    """A grid of AprilTags 36h11, numbered row by row, as OpenCV's GridBoard with a border of one cell.

    The points are the corners of the tags. Kalibr's printed grids have a border of two cells, and cannot be used. The
    board's frame B has its origin at the first corner of the first tag, see `board.Board`.

    Attributes:
        columns: tags along x.
        rows: tags along y.
        square: distance from a tag to the next one, corner to corner [m].
        marker: side of a tag [m]; None leaves a gap of three tenths of a tag, as Kalibr's grids have.

    Raises DrakeTrackerError when there are too few or too many tags, or the tag does not fit.
    """

    columns: int = 6
    rows: int = 4
    square: float = 0.039
    marker: float | None = None

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 2:
            raise DrakeTrackerError(f"a grid of {self.columns} x {self.rows} tags is too small; 2 x 2 is the least")
        if not 0.2 * self.square <= self.side <= 0.95 * self.square:
            raise DrakeTrackerError(
                f"a tag of {self.side:g} m does not suit a distance of {self.square:g} m between tags; it must lie in "
                f"{0.2 * self.square:g}..{0.95 * self.square:g} m"
            )
        _dictionary(TAGS, self.columns * self.rows)

    @property
    def name(self) -> str:
        """The board in words."""
        return f"grid of {self.columns} x {self.rows} AprilTags"

    @property
    def side(self) -> float:
        """Side of a tag [m]."""
        return self.square / 1.3 if self.marker is None else self.marker

    def points(self) -> np.ndarray:
        """Returns p_BQ of the corners of the tags (4 * columns * rows, 3) [m], tag by tag, clockwise from the first."""
        return (super().points()[:, np.newaxis] + self.side * _CLOCKWISE).reshape(-1, 3)

    def turns(self) -> list[np.ndarray]:
        """Returns the order of the points: no turn of the board looks the same."""
        return [np.arange(4 * self.columns * self.rows)]

    def find(self, image: np.ndarray) -> np.ndarray | None:
        """Returns the pixels (n, 2) of the corners in a grey image (h, w), NaN for hidden tags, or None."""
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        corners, ids, _ = cv2.aruco.ArucoDetector(self._opencv.getDictionary(), settings).detectMarkers(image)
        if ids is None or not len(ids):
            return None
        found = np.full((self.columns * self.rows, 4, 2), np.nan)
        for tag, outline in zip(ids.ravel(), corners):
            if tag < len(found):
                # The lines along its sides give a corner to .4 px; a window within the tag's border to .2 px.
                side = np.sqrt(cv2.contourArea(outline))
                window = max(2, int(_WINDOW * side / _TAG_CELLS))
                refined = cv2.cornerSubPix(image, outline.reshape(-1, 1, 2), (window, window), (-1, -1), _REFINE_STOP)
                found[tag] = refined.reshape(4, 2)
        pixels = found.reshape(-1, 2)
        return pixels if enough_points(pixels) and self._fits(pixels) else None

    def _fits(self, pixels: np.ndarray) -> bool:
        """Returns whether pixels (n, 2) lie like the tags of this grid; those of a grid with other columns do not."""
        seen = np.isfinite(pixels).all(axis=1)
        H, _ = cv2.findHomography(pixels[seen], self.points()[seen, :2])
        if H is None:
            return False
        placed = cv2.perspectiveTransform(pixels[seen].reshape(-1, 1, 2), H).reshape(-1, 2)
        errors = np.linalg.norm(placed - self.points()[seen, :2], axis=1)
        return float(np.median(errors)) < _FARTHEST * self.side

    def shapes(self) -> BoardShapes:
        """Returns the black areas of the board."""
        tags = self.points().reshape(-1, 4, 3)[:, :, :2]
        return BoardShapes(_marker_cells(self._opencv, tags), np.zeros((0, 3)))

    @cached_property
    def _opencv(self) -> cv2.aruco.GridBoard:
        size, gap = (self.columns, self.rows), self.square - self.side
        return cv2.aruco.GridBoard(size, self.side, gap, _dictionary(TAGS, self.columns * self.rows))


_CLOCKWISE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


def _dictionary(family: str, count: int) -> cv2.aruco.Dictionary:
    """Returns the dictionary of a family with at least ``count`` markers.

    Raises DrakeTrackerError when there is no such family, or it has fewer.
    """
    if family == TAGS:
        name, most = TAGS, 587
    elif family in FAMILIES:
        most = next((size for size in _SIZES if size >= count), _SIZES[-1])
        name = f"{FAMILIES[family]}_{most}"
    else:
        raise DrakeTrackerError(f"--family {family}: must be one of {', '.join(FAMILIES)}")
    if count > most:
        raise DrakeTrackerError(f"a board with {count} markers is too large; there are {most} different ones")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def _marker_cells(board: cv2.aruco.Board, markers: np.ndarray) -> np.ndarray:
    """Returns the black cells of markers as rectangles (n, 4) [m], those of a row joined.

    Args:
        board: the markers and their dictionary.
        markers: corners of each marker (n, 4, 2) [m], clockwise from the first.
    """
    dictionary = board.getDictionary()
    count = dictionary.markerSize + 2
    rectangles = []
    for marker, corners in zip(board.getIds().ravel(), markers):
        bits = cv2.aruco.generateImageMarker(dictionary, int(marker), count) > 0
        cell = (corners[1, 0] - corners[0, 0]) / count
        for row, line in enumerate(bits):
            edges = np.flatnonzero(np.diff(np.concatenate([[1], line, [1]]).astype(int)))
            for first, last in edges.reshape(-1, 2):
                x, y = corners[0] + cell * np.array([first, row])
                rectangles.append((x, y, cell * (last - first), cell))
    return np.array(rectangles)
