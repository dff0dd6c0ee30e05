"""A memory of the system's own predictions: the errors of predictions made from the same place one lap earlier.

Its only input are packets of predicted path. A packet's first knot says where the object was seen; a later packet's
first knot says where the object went, and hence how large the error of the earlier packet was. On a closed track the
object passes the same place again, and the error in the previous lap is the best estimate of the error in this lap.
"""

from dataclasses import dataclass, field

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import Prediction, evaluate_prediction, packet_target, prediction_knots

MAX_RECORDS = 3000
"""Records kept: 90 s at one packet every 30 ms."""
SAME_HEADING = np.deg2rad(35.0)
"""Directions within this [rad] belong to the same pass of a place; the crossing of a figure eight has two of them."""
EARLIER_LAP = 2.0
"""Records younger than this [s] belong to the present pass of a place, not to an earlier one."""
MAX_GAP = 0.2
"""Longest gap between packets [s] across which predictions are judged."""

STAMP, X, Y, YAW, LATERAL, ALONG, TURN, THERE_X, THERE_Y, THERE_YAW, STD, HEIGHT = range(12)
"""Columns of a record: stamp [s] and place (x, y [m], yaw [rad]) from which the prediction was made; its error at the
horizon across the path [m], along it [m] and in direction [rad]; the place where the object was seen then; the
standard deviation [m] that the prediction gave for it; and the error of its height [m]."""
HEIGHT_LIMIT = 0.015
"""Largest error of the height with which the pads still meet the object beside its middle [m]; chosen."""

NO_RECORDS = np.broadcast_to(0.0, (0, 12))  # read-only


@dataclass(frozen=True, eq=False)
class PredictionMemory(FrozenState):
    """Packets that wait to be judged, and records of judged packets.

    Attributes:
        waiting: `Prediction` vectors, oldest first.
        records: rows (STAMP ... HEIGHT), oldest first, shape (n, 12).
        target: number of the track that all of them are about, 0 with a host that tracks only one object.
    """

    waiting: tuple[np.ndarray, ...] = ()
    records: np.ndarray = field(default_factory=lambda: NO_RECORDS)
    target: int = 0


def remember(memory: PredictionMemory, packet: np.ndarray, horizon: float) -> PredictionMemory:
    """Returns the memory after a new packet. Records of another object are dropped.

    Args:
        memory: the memory before.
        packet: a `Prediction` vector. Its first knot judges the packets that are older than the horizon.
        horizon: time from a packet's stamp to the instant at which its prediction is judged [s].
    """
    packet = np.asarray(packet)
    stamp = _stamp(packet)
    if not Prediction(packet).valid or (memory.waiting and stamp <= _stamp(memory.waiting[-1])):
        return memory
    target = packet_target(Prediction(packet).seq)
    if target != memory.target:
        memory = PredictionMemory(target=target)
    judged = []
    waiting = list(memory.waiting)
    if waiting and stamp - _stamp(waiting[-1]) > MAX_GAP:
        waiting = []
    while waiting and _stamp(waiting[0]) + horizon <= stamp:
        old = waiting.pop(0)
        previous = waiting[-1] if waiting else old
        judged.append(_judge(old, previous, packet, _stamp(old) + horizon))
    waiting.append(packet.copy())
    records = memory.records
    if judged:
        records = read_only(np.vstack([records, judged])[-MAX_RECORDS:])
    return PredictionMemory(tuple(waiting), records, target)


def recall(memory: PredictionMemory, packet: np.ndarray, radius: float) -> np.ndarray:
    """Returns the records of earlier passes of the place from which a packet starts, shape (n, 12).

    Args:
        memory: the memory.
        packet: a `Prediction` vector.
        radius: distance below which two places count as the same [m].
    """
    records = memory.records
    stamp, (x, y, _, yaw, _) = _stamp(packet), prediction_knots(packet)[0]
    near = np.hypot(records[:, X] - x, records[:, Y] - y) <= radius
    same_direction = np.cos(records[:, YAW] - yaw) >= np.cos(SAME_HEADING)
    return records[near & same_direction & (records[:, STAMP] < stamp - EARLIER_LAP)]


def recent(memory: PredictionMemory, now: float, duration: float) -> np.ndarray:
    """Returns the records of packets stamped within the last ``duration`` [s] before ``now`` [s], shape (n, 12)."""
    return memory.records[memory.records[:, STAMP] >= now - duration]


def places_seen(memory: PredictionMemory) -> np.ndarray:
    """Returns where the object was seen: rows (stamp [s], x, y [m]) of all packets, judged or not, shape (n, 3)."""
    waiting = [(_stamp(packet), *prediction_knots(packet)[0][:2]) for packet in memory.waiting]
    return np.vstack([memory.records[:, [STAMP, X, Y]], *waiting])


def _judge(old: np.ndarray, before: np.ndarray, after: np.ndarray, time: float) -> tuple[float, ...]:
    """Returns the record of a packet.

    Args:
        old: the `Prediction` vector that is judged.
        before: a later one, from before the time.
        after: a later one, from after the time.
        time: time [s] for which the prediction is compared with where the object was seen.
    """
    seen = _interpolate_first_knots(before, after, time)
    *predicted, std = evaluate_prediction(old, time)
    error = np.array(predicted) - seen
    c, s = np.cos(seen[3]), np.sin(seen[3])
    x, y, _, yaw, _ = prediction_knots(old)[0]
    turn = np.arctan2(np.sin(error[3]), np.cos(error[3]))
    across, along = -s * error[0] + c * error[1], c * error[0] + s * error[1]
    return (_stamp(old), x, y, yaw, across, along, turn, seen[0], seen[1], seen[3], std, error[2])


def _interpolate_first_knots(before: np.ndarray, after: np.ndarray, time: float) -> np.ndarray:
    """Returns the pose (x, y, z, yaw) of the object at a time [s] between the stamps of two packets, shape (4,)."""
    a, b = prediction_knots(before)[0][:4], prediction_knots(after)[0][:4].copy()
    b[3] = a[3] + np.arctan2(np.sin(b[3] - a[3]), np.cos(b[3] - a[3]))
    span = _stamp(after) - _stamp(before)
    return a + (b - a) * ((time - _stamp(before)) / span if span > 0 else 1.0)


def _stamp(packet: np.ndarray) -> float:
    return Prediction(packet).stamp
