"""Whether the images of two cameras show the same moments, judged by how closely the rays of a track meet.

If the second recording began later than assumed, its rays belong to later moments. The gap between the two rays is
then the distance that the object moves across the rays in this time. The offset that makes the gaps smallest is found
by a search over shifts of the second track.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel

_LARGEST_SHIFT = 2.0
"""Largest offset that is looked for [s], at most a third of the duration of the track."""
_STEP = 0.25
"""Step of the search [cycles]."""
_LEAST_ROWS = 20
"""Least number of rows that both cameras have in common after a shift."""
_KEPT = 0.8
"""Share of the rows with the smallest gaps; the others may belong to another object, or to noise."""
_CORRELATED = 5.0
"""Number of consecutive rows whose errors count as one, because a detector errs similarly in similar images."""
_SIGNIFICANT = 3.0
"""Number of standard deviations from which on an offset is reported."""
_CLEARER = 2.0
"""Least ratio of the mean square gap with and without the offset."""
MOST_GAP = 4.0
"""Largest root mean square gap of a sound calibration [px]."""
_VAGUE = 0.03
"""Standard deviation of the offset [s] from which on the motion does not show it."""
_AMBIGUOUS, _APART = 1.5, 8
"""Another minimum is as good if its mean square gap is less than this multiple; it is this number of cycles away."""


class Moments(NamedTuple):
    """What the rays of a track say about the clocks of its two cameras.

    Attributes:
        offset: time by which the second recording seems to begin later than was assumed [s]; 0.0 if none is
            significant, None if the motion does not show it.
        gap: root mean square of the gap between the rays at this offset [px of the first camera].
    """

    offset: float | None
    gap: float


def compare_moments(data: Mapping[str, np.ndarray], cameras: Sequence[CameraModel], period: float) -> Moments | None:
    """Returns what the rays of a track say about the clocks of its cameras, None if there are too few rays.

    Args:
        data: columns of the track of two cameras, see `TrackTable.data`.
        cameras: calibration of each camera.
        period: period of the images [s].
    """
    stamps = data["stamp"]
    left, right = (np.column_stack([data[f"{side}_u"], data[f"{side}_v"]]) for side in ("left", "right"))
    if len(np.unique(stamps)) < len(stamps) or len(stamps) < _LEAST_ROWS:
        return None
    limit = min(_LARGEST_SHIFT, np.ptp(stamps) / 3.0)
    shifts = _STEP * period * np.arange(-round(limit / period / _STEP), round(limit / period / _STEP) + 1)
    costs = np.array([_mean_square_gap(cameras, stamps, left, right, shift, period) for shift in shifts])
    if not np.isfinite(costs[len(costs) // 2]):
        return None
    best = int(np.nanargmin(costs))
    if not 0 < best < len(costs) - 1 or not np.isfinite(costs[[best - 1, best + 1]]).all():
        return Moments(None, float(np.sqrt(costs[best])))
    before, least, after = costs[best - 1 : best + 2]
    curvature = (before + after - 2.0 * least) / 2.0
    offset = shifts[best] + _STEP * period * (before - after) / 4.0 / max(curvature, 1e-12)
    rows = np.isfinite(left).all(axis=1) & np.isfinite(right).all(axis=1)
    speed_squared = curvature / (_STEP * period) ** 2  # mean square speed at which the gap grows with the offset
    std = np.sqrt(least / max(speed_squared, 1e-12) * _CORRELATED / max(rows.sum(), 1))
    far = np.abs(np.arange(len(costs)) - best) > _APART / _STEP
    if std > _VAGUE or (costs[far] < _AMBIGUOUS * least).any():
        return Moments(None, float(np.sqrt(least)))
    clear = costs[len(costs) // 2] > _CLEARER * least and abs(offset) > max(_SIGNIFICANT * std, _STEP * period)
    return Moments(float(offset) if clear else 0.0, float(np.sqrt(least)))


def describe_moments(found: Moments | None, given: float, live: bool, shared: bool) -> str | None:
    """Returns one line on what is wrong with the clocks or with the rays of two cameras, None if nothing is.

    Args:
        found: the return value of `compare_moments`.
        given: offset that was assumed [s].
        live: whether the cameras are live.
        shared: whether the images of both cameras have stamps of one clock.
    """
    if found is None:
        return None
    if found.offset:
        later = "later" if found.offset > 0.0 else "earlier"
        if live:
            return (
                f"The images of the second camera seem to be captured {abs(found.offset):.3f} s {later} than those of "
                "the first one: measure the latency of both cameras with drake-tracker lag"
            )
        return (
            f"The second recording seems to begin {abs(found.offset):.3f} s {later} than assumed: --offset "
            f"{found.offset + given:.3f}"
        )
    if found.gap > MOST_GAP:
        return (
            f"The rays of the two cameras miss each other by {found.gap:.1f} px (root mean square) at any offset: was "
            "a camera moved after the calibration, or is it the calibration of other cameras?"
        )
    if found.offset is None and not shared:
        return (
            "Whether both recordings begin at the same moment cannot be judged: the rays of this motion meet at other "
            "offsets, too"
        )
    return None


def _mean_square_gap(
    cameras: Sequence[CameraModel], stamps: np.ndarray, left: np.ndarray, right: np.ndarray, shift: float, period: float
) -> float:
    """Returns the mean square gap [px^2] when the second track is shifted to later moments, NaN for too few rows.

    Args:
        cameras: calibration of each camera.
        stamps: of the rows, shape (n,) [s].
        left: places in the first images, shape (n, 2) [px], NaN without one.
        right: the same in the second images.
        shift: time by which the second images were captured later than their stamps [s].
        period: period of the images [s].
    """
    seen = np.isfinite(right).all(axis=1)
    times, places = stamps[seen] + shift, right[seen]
    if len(times) < 2:
        return np.nan
    after = np.clip(np.searchsorted(times, stamps), 1, len(times) - 1)
    near = (times[after] - times[after - 1] < 2.5 * period) & (stamps >= times[0]) & (stamps <= times[-1])
    near &= np.isfinite(left).all(axis=1)
    if near.sum() < _LEAST_ROWS:
        return np.nan
    moved = np.column_stack([np.interp(stamps[near], times, column) for column in places.T])
    a, d = cameras[0].rays(left[near])
    b, e = cameras[1].rays(moved)
    normal = np.cross(d, e)
    sine = np.linalg.norm(normal, axis=1)
    gaps = np.abs(((b - a) * normal).sum(axis=1)) / np.maximum(sine, 1e-6)
    distances = np.linalg.norm(np.cross(b - a, e), axis=-1) / np.maximum(sine, 1e-6)  # along the first ray
    pixels = np.sort(gaps / np.maximum(distances, 1e-9) * cameras[0].focal_lengths[0])
    return float(np.mean(pixels[: max(1, int(_KEPT * len(pixels)))] ** 2))
