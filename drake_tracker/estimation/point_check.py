"""Which measured points the host uses: one that cannot be right must neither end it nor spoil what it has learned."""

import numpy as np

from drake_tracker.core.messages import TrackPoint

FARTHEST = 1000.0
"""Largest coordinate of a point [m]: more than any laboratory has, and small enough for all arithmetic."""
OLDEST = 600
"""Age of a point [cycles] from which it is too old: 10 s at 60 Hz. The longest lag of the vision is 120 cycles."""


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
