"""Whether two cameras were given in the wrong order, judged by the centroids that they measured."""

from collections.abc import Mapping, Sequence

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.image_tracker import assign
from drake_tracker.vision.image_tracks.reidentification import CONFIRM_AFTER

_MOST_ROWS = 200
"""Number of rows that are judged; more rows would not change the result."""
_SEEN, _MISSED = 0.8, 0.5
"""Least fraction of points that meet with exchanged cameras, and the fraction below which they do not as given."""
_CLOSE, _CLOSER = 0.4, 0.5
"""With several objects: largest gap with exchanged cameras, root mean square, as a share of the largest one, and as a
share of that with the cameras as given."""


def are_swapped(
    data: Mapping[str, np.ndarray],
    cameras: Sequence[CameraModel],
    max_gap: float,
    seen: Sequence[tuple[np.ndarray, np.ndarray]] = (),
) -> bool:
    """Returns whether the rays of a track meet when its two cameras are exchanged, and do not meet as they were given.

    Args:
        data: columns of the track of two cameras, see `TrackTable.data`.
        cameras: calibration of each camera, in the order given.
        max_gap: largest gap between two rays of one point [m].
        seen: with several objects, what `places` returned for each pair of images; the columns have centroids only of
            objects whose rays meet.
    """
    if seen:
        return _are_swapped(seen, cameras, max_gap)
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


def places(views: Sequence[ImageObjects | None]) -> tuple[np.ndarray, np.ndarray]:
    """Returns where the left and the right image show objects, shapes (n, 2) and (m, 2) [px].

    Args:
        views: the objects in both images, None where an image is missing.
    """
    left, right = (
        np.array(
            [
                track.place
                for track in ([] if view is None else view.tracks)
                if track.seen == track.stamp and track.hits >= CONFIRM_AFTER
            ]
        ).reshape(-1, 2)
        for view in views
    )
    return left, right


def _are_swapped(seen: Sequence[tuple[np.ndarray, np.ndarray]], cameras: Sequence[CameraModel], max_gap: float) -> bool:
    """Returns the same result, computed from several objects.

    Rays of different objects meet by chance, so that how closely they meet is compared.

    Args:
        seen: see `are_swapped`.
        cameras: calibration of each camera, in the order given.
        max_gap: largest gap between two rays of one point [m].
    """
    seen = [each for each in seen if len(each[0]) and len(each[1])]
    seen = seen[:: max(1, len(seen) // _MOST_ROWS)]
    if not seen:
        return False
    as_given = np.concatenate([_shares(cameras, left, right, max_gap) for left, right in seen])
    exchanged = np.concatenate([_shares(cameras, right, left, max_gap) for left, right in seen])
    rms = [float(np.sqrt(np.mean(each**2))) for each in (as_given, exchanged)]
    return rms[1] < min(_CLOSE, _CLOSER * rms[0])


def _shares(cameras: Sequence[CameraModel], left: np.ndarray, right: np.ndarray, max_gap: float) -> np.ndarray:
    """Returns the gaps of the objects that two images show, as shares of the largest gap, at most 1, shape (n,).

    Each ray meets at most one other ray; the gaps belong to the best assignment.

    Args:
        cameras: of the images.
        left: where the first shows objects, shape (n, 2) [px].
        right: the same in the second, shape (m, 2) [px].
        max_gap: largest gap between two rays of one point [m].
    """
    points = [[triangulate(cameras[0], cameras[1], one, other) for other in right.tolist()] for one in left.tolist()]
    shares = np.array([[1.0 if each is None else min(each.gap / max_gap, 1.0) for each in row] for row in points])
    rows, columns = assign(shares**2)
    return shares[list(rows), list(columns)]
