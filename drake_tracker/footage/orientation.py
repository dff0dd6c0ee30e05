"""The orientation in which images are to be shown: a telephone stores the rows of its sensor and adds a matrix."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Orientation:
    """A transposition followed by reflections, which together are any quarter turn with or without a mirror image.

    Attributes:
        transposed: whether rows and columns are exchanged.
        flip_x: whether the columns are then reversed.
        flip_y: whether the rows are then reversed.
    """

    transposed: bool = False
    flip_x: bool = False
    flip_y: bool = False

    def size(self, width: int, height: int) -> tuple[int, int]:
        """Returns (width, height) [px] of an image as it is shown, from those of the stored image."""
        return (height, width) if self.transposed else (width, height)

    def apply(self, image: np.ndarray) -> np.ndarray:
        """Returns an image (h, w, 3) as it is shown."""
        if self == Orientation():
            return image
        shown = image.transpose(1, 0, 2) if self.transposed else image
        return np.ascontiguousarray(shown[:: -1 if self.flip_y else 1, :: -1 if self.flip_x else 1])


def read_orientation(matrix: bytes | memoryview) -> Orientation:
    """Returns the `Orientation` of a display matrix.

    The matrix has nine numbers a b u, c d v, x y w as in ISO/IEC 14496-12, 8.3.2: a pixel at (p, q) is shown at
    (a p + c q + x, b p + d q + y). Turns other than quarter turns are taken as the nearest quarter turn.

    Args:
        matrix: 36 bytes, int32 in the order of this machine.
    """
    a, b, _, c, d = np.frombuffer(matrix, np.int32, 5).tolist()
    if abs(a) + abs(d) >= abs(b) + abs(c):
        return Orientation(False, a < 0, d < 0)
    return Orientation(True, c < 0, b < 0)
