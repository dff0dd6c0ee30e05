"""The messages around a camera on the hand: from packet and tracks to its input, and from its output to tracks and
points."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.core.messages import (
    TRACK_FIELDS,
    Prediction,
    TrackPoints,
    evaluate_prediction,
    message_rows,
    packet_target,
    prediction_end,
)
from drake_tracker.vision.hand.wrist_measurement import Expectation, FixedPoint, WristMeasurement, WristReason
from drake_tracker.vision.silhouettes.target import Reason

_NUMBER, _X, _XX, _GAP, _SEEN, _SIZE = (
    TRACK_FIELDS.index(name) for name in ("number", "x", "xx", "gap", "seen", "size")
)
_UPPER = np.triu_indices(3)
FIXED, WRIST = 1, 2
"""Sources of a point; their sum means both."""


def expectation(packet: np.ndarray | None, target: int, stamp: float) -> Expectation | None:
    """Returns where a packet predicts an object, None if it does not.

    Args:
        packet: a `Prediction` vector, or None.
        target: number of the object's track.
        stamp: time of the prediction [s].
    """
    if packet is None or not Prediction(packet).valid or packet_target(Prediction(packet).seq) != target:
        return None
    if not Prediction(packet).stamp <= stamp <= prediction_end(packet):
        return None
    x, y, z, yaw, _ = evaluate_prediction(packet, stamp)
    return Expectation(np.array([x, y, z]), float(yaw))


def track_row(tracks: np.ndarray, number: int) -> np.ndarray | None:
    """Returns the fields `TRACK_FIELDS` of a track, as a view of the message; None if it has no such track.

    Args:
        tracks: a `TrackPoints` vector.
        number: of the track, 0 for none.
    """
    return next((row for row in message_rows(tracks, TRACK_FIELDS) if number and row[_NUMBER] == number), None)


def fixed_point(row: np.ndarray, stamp: float) -> FixedPoint | None:
    """Returns the measurement of a track by the fixed cameras, None if they did not see it at a stamp [s].

    Args:
        row: the track, with the fields `TRACK_FIELDS`.
        stamp: of the message [s].
    """
    if row[_SEEN] < stamp or not np.isfinite(row).all():
        return None
    covariance = np.zeros((3, 3))
    covariance[_UPPER] = row[_XX : _XX + 6]
    covariance = covariance + np.triu(covariance, 1).T
    return FixedPoint(row[_X : _X + 3].copy(), covariance, float(row[_SIZE]))


def fused(
    tracks: np.ndarray, point: np.ndarray, target: int, fixed: FixedPoint | None, measured: WristMeasurement
) -> tuple[np.ndarray, np.ndarray, int]:
    """Returns the tracks and the point of the target with the measurement of the camera on the hand.

    Args:
        tracks: a `TrackPoints` vector of the fixed cameras.
        point: a `TrackPoint` vector of theirs.
        target: number of the target's track, 0 without one.
        fixed: what they measured of the target, None for nothing.
        measured: what the camera on the hand measured.

    Returns (tracks, point, source): vectors of the same types, and the sum of `FIXED` and `WRIST`, each if it was used.
    """
    if measured.reason is not WristReason.VALID:
        return tracks.copy(), point.copy(), FIXED if fixed is not None else 0
    both = [(measured.p_WQ, measured.covariance)]
    if fixed is not None:
        both.append((fixed.p_WQ, fixed.covariance))
    p_WQ, covariance = fuse(both)
    tracks, stamp = tracks.copy(), TrackPoints(tracks).stamp
    TrackPoints(tracks).reason = Reason.NONE
    row = track_row(tracks, target)
    assert row is not None, "only a target with a track is measured"
    row[_X : _X + 3], row[_XX : _XX + 6], row[_SEEN] = p_WQ, covariance[_UPPER], stamp
    fused_point = np.array([stamp, *p_WQ, row[_GAP], 1.0])
    return tracks, fused_point, WRIST + (FIXED if fixed is not None else 0)


def pack_wrist(stamp: float, measured: WristMeasurement, source: int) -> np.ndarray:
    """Returns the `WristPoint` vector of a measurement.

    Args:
        stamp: of the image [s].
        measured: what the camera on the hand measured.
        source: what the point of the target comes from.
    """
    valid = measured.reason is WristReason.VALID
    return np.array(
        [stamp, *measured.p_WQ, *measured.covariance[_UPPER], measured.correlation, measured.reason, source, valid],
        dtype=float,
    )


def fuse(measurements: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the most likely point and its covariance, for independent errors: the information filter.

    Args:
        measurements: (point of shape (n,), covariance (n, n)) of each sensor, one or more.

    Returns (point of shape (n,), covariance (n, n)).
    """
    if len(measurements) == 1:
        return measurements[0]
    information = [np.linalg.inv(covariance) for _, covariance in measurements]
    covariance = np.linalg.inv(np.sum(information, axis=0))
    point = covariance @ np.sum([each @ point for each, (point, _) in zip(information, measurements)], axis=0)
    return point, 0.5 * (covariance + covariance.T)
