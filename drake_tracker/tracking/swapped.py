"""Whether two cameras were given in the wrong order, judged by the centroids that they measured."""

from collections.abc import Mapping, Sequence

import numpy as np

from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.triangulation import triangulate

_MOST_ROWS = 200
"""Number of rows that are judged; more say the same."""
_SEEN, _MISSED = 0.8, 0.5
"""Least fraction of points that meet with exchanged cameras, and the fraction below which they do not as given."""


def are_swapped(data: Mapping[str, np.ndarray], cameras: Sequence[CameraModel], max_gap: float) -> bool:
    """Returns whether the rays of a track meet when its two cameras are exchanged, and do not meet as they were given.

    Args:
        data: columns of the track of two cameras, see `TrackTable.data`.
        cameras: calibration of each camera, in the order given.
        max_gap: largest gap between two rays of one point [m].
    """
    uv = np.column_stack([data[f"{side}_{axis}"] for side in ("left", "right") for axis in "uv"])
    uv = uv[np.isfinite(uv).all(axis=1)]
    uv = uv[:: max(1, len(uv) // _MOST_ROWS)]
    if not len(uv):
        return False
    left, right = cameras

    def meet(first: np.ndarray, second: np.ndarray) -> float:
        found = [triangulate(left, right, one.tolist(), other.tolist()) for one, other in zip(first, second)]
        return sum(point is not None and point.gap <= max_gap for point in found) / len(found)

    return meet(uv[:, :2], uv[:, 2:]) < _MISSED and meet(uv[:, 2:], uv[:, :2]) > _SEEN
