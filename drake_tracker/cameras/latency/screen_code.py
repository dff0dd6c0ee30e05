"""The running code on the screen: four fields with times, between four markers.

The code is a grid of black and white cells on white, 31 x 17 with its margin. A marker of OpenCV's dictionary
DICT_4X4_50 is in each corner. Between the markers are four fields of 6 x 6 cells, of which each holds a time in
milliseconds. The screen changes one field at a time, in turn: while one is being changed, which a camera sees as a
mixture, the others stand still. A field has 24 bits of the time and a checksum of 8 bits (CRC-8, polynomial 0x07,
beginning with 0xFF, ITU-T I.432.1 without the final exclusive or). The four cells in its corners are always white,
black, black, white, which gives the grey value that separates both.
"""

from collections.abc import Sequence

import cv2
import numpy as np

SIZE = (31, 17)
"""Columns and rows of the grid with its margin [cells]."""
SIDE = 6
"""Side of a marker and of a field [cells]."""
MARKERS = ((1, 1), (24, 1), (1, 10), (24, 10))
"""Upper left cell (column, row) of the markers 0 to 3; each has a white cell around it."""
FIELDS = ((9, 1), (16, 1), (9, 10), (16, 10))
"""Upper left cell (column, row) of the fields, in the order in which they are changed."""
TIME_BITS, CHECK_BITS = 24, 8
RANGE = 1 << TIME_BITS
"""Number of milliseconds after which the times repeat: 4.7 hours."""
POLYNOMIAL, FIRST = 0x07, 0xFF
_CORNERS = {(0, 0): True, (0, SIDE - 1): False, (SIDE - 1, 0): False, (SIDE - 1, SIDE - 1): True}
"""{(row, column): whether it is white} of the cells in the corners of a field."""
ORDER = tuple(
    sorted(
        (SIDE * row + column for row in range(SIDE) for column in range(SIDE) if (row, column) not in _CORNERS),
        key=lambda cell: -abs(cell // SIDE - 0.5 * (SIDE - 1)),
    )
)
"""Cells of a field, row by row from 0, that hold the bits from the highest to the checksum. The bits that change most
are in the middle: a screen that draws from top to bottom changes them, on average, when it draws the middle."""


def dictionary() -> "cv2.aruco.Dictionary":
    """Returns the markers of the corners."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)


def marker_cells(number: int) -> np.ndarray:
    """Returns the cells of a marker, bool of shape (6, 6), True where it is white."""
    return cv2.aruco.generateImageMarker(dictionary(), number, SIDE) > 0


def checksum(time: int) -> int:
    """Returns the checksum of a time [ms], 8 bits."""
    value = FIRST
    for shift in range(TIME_BITS - 8, -1, -8):
        value ^= time >> shift & 0xFF
        for _ in range(8):
            value = value << 1 & 0xFF ^ (POLYNOMIAL if value & 0x80 else 0)
    return value


def field_cells(time: int) -> np.ndarray:
    """Returns the cells of a field, bool of shape (6, 6), True where it is white.

    Args:
        time: [ms], of which the lowest 24 bits are shown.
    """
    time %= RANGE
    word = time << CHECK_BITS | checksum(time)
    bits = [word >> shift & 1 == 1 for shift in range(TIME_BITS + CHECK_BITS - 1, -1, -1)]
    cells = np.zeros(SIDE * SIDE, bool)
    cells[list(ORDER)] = bits
    for (row, column), white in _CORNERS.items():
        cells[SIDE * row + column] = white
    return cells.reshape(SIDE, SIDE)


def read_field(cells: np.ndarray) -> int | None:
    """Returns the time [ms] in a field, or None when its checksum is wrong.

    Args:
        cells: bool, shape (6, 6), True where it is white.
    """
    word = int("".join("1" if bit else "0" for bit in cells.ravel()[list(ORDER)]), 2)
    time = word >> CHECK_BITS
    return time if checksum(time) == word & (1 << CHECK_BITS) - 1 else None


def draw_code(times: Sequence[int], cell: int = 1) -> np.ndarray:
    """Returns the code as a grey image, uint8, shape (17 cell, 31 cell).

    Args:
        times: in the four fields [ms].
        cell: side of a cell [px].
    """
    grid = np.full(SIZE[::-1], 255, np.uint8)
    parts = [(place, marker_cells(number)) for number, place in enumerate(MARKERS)]
    parts += [(place, field_cells(time)) for place, time in zip(FIELDS, times, strict=True)]
    for (column, row), cells in parts:
        grid[row : row + SIDE, column : column + SIDE] = np.where(cells, 255, 0)
    return np.kron(grid, np.ones((cell, cell), np.uint8))
