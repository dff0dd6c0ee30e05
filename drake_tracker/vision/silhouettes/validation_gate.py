"""Where a tracked object is expected in one image, and how large it appears."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

UNCONFIRMED = -1
"""Number of a track that is not yet confirmed."""


@dataclass(frozen=True, eq=False)
class ValidationGate:
    """The expected place of an object in one image.

    Attributes:
        track: number of its track.
        u: column of the expected centroid [px], full frame.
        v: row [px].
        std: standard deviation of the expectation [px].
        edges: the edges of the object's box, projected, as columns, shape (2, 3) [px].
        pixels: expected number of pixels.
        depth: distance from the camera [m].
        jacobian: derivative of the centroid (u, v) by the position, shape (2, 3) [px/m].
        settled: whether the extents are well known.
        sized: whether they are known for the present direction of travel at least.
    """

    track: int
    u: float
    v: float
    std: float
    edges: np.ndarray
    pixels: float
    depth: float
    jacobian: np.ndarray
    settled: bool = True
    sized: bool = True

    @cached_property
    def centre(self) -> np.ndarray:
        """The expected centroid, shape (2,) [px]."""
        return np.array([self.u, self.v])

    @cached_property
    def extents(self) -> np.ndarray:
        """Expected extents along u and v, shape (2,) [px]."""
        return np.abs(self.edges).sum(axis=1)

    @cached_property
    def radius(self) -> float:
        """Radius of a disc that contains the object [px]."""
        return 0.5 * math.hypot(*self.extents) + 1.0
