"""Checks of the measured points: an impossible point must neither end the host nor spoil a learned path."""

import math

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import TrackPoint

FARTHEST = 1000.0
"""Largest coordinate of a point [m]: more than any laboratory has, and small enough for all arithmetic."""
OLDEST = 600
"""Age of a point [cycles] from which it is too old: 10 s at 60 Hz. The longest lag of the vision is 120 cycles."""
SPACING = 0.004
"""Distance between two places that are remembered [m], a few standard deviations of a point."""
NEAREST_PLACE, FARTHEST_PLACE = 0.012, 0.030
"""Range of distances from the place of rest within which earlier positions give the direction [m]. Nearer positions are
too noisy; farther positions may lie before a corner."""
MOST_PLACES = 30
"""Places that are remembered."""

NO_TRAIL = read_only(np.zeros((0, 2)))


def refuse_point(point: np.ndarray, time: float, period: float, farthest: float = FARTHEST) -> str | None:
    """Returns in words why a point cannot be right, None when it can or is not valid.

    Args:
        point: a `TrackPoint` vector.
        time: time of the cycle in which it came [s].
        period: period of the cycles [s], by which a rounded stamp may be later than ``time``.
        farthest: largest coordinate [m].
    """
    fields = TrackPoint(point)
    if fields.valid == 0.0:
        return None
    if not np.isfinite(point).all():
        return "a number is not finite"
    if max(abs(fields.x), abs(fields.y), abs(fields.z)) > farthest:
        return f"it is more than {farthest:g} m away"
    if fields.stamp > time + period:
        return "its stamp is later than the cycle in which it came"
    if fields.stamp < time - OLDEST * period:
        return f"it is more than {OLDEST * period:g} s old"
    return None


def passed(trail: np.ndarray, x: float, y: float) -> np.ndarray:
    """Returns the trail of an object after it was seen at a place.

    Args:
        trail: places (x, y) in W, oldest first, shape (n, 2) [m].
        x: x of the place [m].
        y: y of the place [m].
    """
    if len(trail) and math.hypot(x - trail[-1, 0], y - trail[-1, 1]) < SPACING:
        return trail
    return read_only(np.vstack([trail, [x, y]])[-MOST_PLACES:])


def heading_at_rest(trail: np.ndarray, x: float, y: float, heading: float) -> float:
    """Returns the direction of an object at rest [rad], up to a quarter of a turn from the stated one.

    The object lies along the last piece of its path, in one of two directions. Of both directions of the line, the
    direction nearer to the stated direction is returned: the object may have backed up, and the jaws are symmetric.

    Args:
        trail: the places that it passed, shape (n, 2) [m].
        x: x of its place of rest [m].
        y: y of its place of rest [m].
        heading: the stated direction, which is returned when the object has passed no suitable place [rad].
    """
    away = np.array([x, y]) - trail
    distances = np.hypot(*away.T)
    # Only the last approach counts; the object may have passed the same place before.
    outside = np.flatnonzero(distances > FARTHEST_PLACE)
    last = np.arange(len(trail)) > (outside[-1] if len(outside) else -1)
    told = away[last & (distances >= NEAREST_PLACE)]
    if len(told) == 0:
        return heading
    dx, dy = told.mean(axis=0)
    return heading + math.remainder(math.atan2(dy, dx) - heading, math.pi)
