"""A memory of the system's own predictions: did those made from this place, one lap earlier, come true?

Nothing but packets of predicted path goes in. A packet's first knot says where the object was seen; a later packet's
first knot says where it went, and so how far off the earlier packet was. On a closed track the object comes by the same
place again, and what happened then is the best guess of what will happen now.
"""

from dataclasses import dataclass, field

import numpy as np

from drake_tracker.core.messages import Prediction, evaluate_prediction, prediction_knots

MAX_RECORDS = 3000
"""Records kept: 90 s at one packet each 30 ms."""
SAME_HEADING = np.deg2rad(35.0)
"""Directions this near belong to the same pass of a place, which a figure-eight's crossing visits in two directions."""
EARLIER_LAP = 2.0
"""Records younger than this [s] belong to the present pass of a place, not to an earlier one."""

MAX_GAP = 0.2
"""After a gap in the packets longer than this [s] nobody saw what came of the predictions made before it."""

STAMP, X, Y, YAW, LATERAL, ALONG, TURN, THERE_X, THERE_Y, THERE_YAW = range(10)
"""Columns of a record: stamp [s] and place (x, y [m], yaw [rad]) from which the prediction was made; its error over the
horizon across the path [m], along it [m], and in direction [rad]; and where the object was seen then, as the place."""


NO_RECORDS = np.broadcast_to(0.0, (0, 10))  # read-only


@dataclass(frozen=True, eq=False)
class PredictionMemory:
    """Packets that wait to be judged, and records of those that were.

    ``waiting`` is a tuple of packets, ``records``, shape (n, 10), has rows (STAMP ... THERE_YAW); both oldest first.
    """

    waiting: tuple = ()
    records: np.ndarray = field(default_factory=lambda: NO_RECORDS)

    def __deepcopy__(self, memo):
        return self


def remember(memory, packet, horizon):
    """Returns the memory after a new packet: those that are a ``horizon`` [s] old are judged by its first knot."""
    packet = np.asarray(packet)
    if not Prediction(packet).valid or (memory.waiting and packet[0] <= memory.waiting[-1][0]):
        return memory
    judged = []
    waiting = list(memory.waiting)
    if waiting and packet[0] - waiting[-1][0] > MAX_GAP:
        waiting = []
    while waiting and waiting[0][0] + horizon <= packet[0]:
        old = waiting.pop(0)
        previous = waiting[-1] if waiting else old
        judged.append(_judge(old, previous, packet, old[0] + horizon))
    waiting.append(packet.copy())
    records = memory.records
    if judged:
        records = np.vstack([records, judged])[-MAX_RECORDS:]
        records.setflags(write=False)
    return PredictionMemory(tuple(waiting), records)


def recall(memory, packet, radius):
    """Returns the records, shape (n, 10), of earlier passes of the place from which ``packet`` starts."""
    records = memory.records
    stamp, (x, y, _, yaw, _) = packet[0], prediction_knots(packet)[0]
    near = np.hypot(records[:, X] - x, records[:, Y] - y) <= radius
    same_way = np.cos(records[:, YAW] - yaw) >= np.cos(SAME_HEADING)
    return records[near & same_way & (records[:, STAMP] < stamp - EARLIER_LAP)]


def recent(memory, now, duration):
    """Returns the records, shape (n, 10), judged of packets stamped within the last ``duration`` [s] before ``now``."""
    return memory.records[memory.records[:, STAMP] >= now - duration]


def _judge(old, before, after, time):
    """Compares what ``old`` predicted for ``time`` with where two later packets saw the object, before and after it."""
    seen = _interpolate_first_knots(before, after, time)
    error = evaluate_prediction(old, time)[:4] - seen
    c, s = np.cos(seen[3]), np.sin(seen[3])
    x, y, _, yaw, _ = prediction_knots(old)[0]
    turn = np.arctan2(np.sin(error[3]), np.cos(error[3]))
    across, along = -s * error[0] + c * error[1], c * error[0] + s * error[1]
    return (old[0], x, y, yaw, across, along, turn, seen[0], seen[1], seen[3])


def _interpolate_first_knots(before, after, time):
    a, b = prediction_knots(before)[0][:4], prediction_knots(after)[0][:4].copy()
    b[3] = a[3] + np.arctan2(np.sin(b[3] - a[3]), np.cos(b[3] - a[3]))
    span = after[0] - before[0]
    return a + (b - a) * ((time - before[0]) / span if span > 0 else 1.0)
