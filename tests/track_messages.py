"""Messages of a vision that tracks several objects, made up for tests."""

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import (
    REGION_FIELDS,
    TRACK_FIELDS,
    Regions,
    TrackPoints,
    TrackState,
    message_rows,
    message_size,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.silhouettes.target import Reason


def track(number, x=0.5, y=0.0, *, state=TrackState.MOVING, vx=0.0, vy=0.0, size=0.1):
    """One track, as a dict of its fields."""
    return {"number": number, "state": state, "x": x, "y": y, "z": 0.485, "vx": vx, "vy": vy, "size": size}


def track_points(stamp, tracks=(), target=0, reason=Reason.NONE, overflow=0):
    """A `TrackPoints` vector."""
    vector = np.zeros(message_size(TrackPoints))
    header = TrackPoints(vector)
    header.stamp, header.target, header.reason, header.valid = stamp, target, reason, 1.0
    header.overflow = overflow
    for row, values in zip(message_rows(vector, TRACK_FIELDS), tracks):
        row[:] = [values.get(field, 0.0) for field in TRACK_FIELDS]
    return vector


def regions(stamp, *found):
    """A `Regions` vector of regions (u, v, width, height, number of the track)."""
    vector = np.zeros(message_size(Regions))
    header = Regions(vector)
    header.stamp, header.count, header.usable = stamp, len(found), 1.0
    for row, (u, v, width, height, number) in zip(message_rows(vector, REGION_FIELDS), found):
        values = {"u": u, "v": v, "pixels": width * height, "width": width, "height": height, "track": number}
        row[:] = [values.get(field, 0.0) for field in REGION_FIELDS]
    return vector


def tracks_signal(message, cycles):
    """The signal of a run whose cycles k have the messages ``message(k)``."""
    data = np.array([message(k) for k in range(cycles)])
    return Signal(VISION_PERIOD * np.arange(cycles), data, tuple(TrackPoints.get_fields()))
