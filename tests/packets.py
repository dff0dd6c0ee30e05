"""Packets of predicted path for tests: good ones, and one of each kind that the arm must reject."""

import numpy as np

from drake_tracker.arm.safety.packet_guard import Rejection
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    PREDICTION_HEADER,
    Prediction,
    pack_prediction,
    prediction_knots,
)

VOLUME = np.array([[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]])
"""Where vision sees the train, as in the default scenario."""
TABLE_HEIGHT, TRAIN_Z = 0.45, 0.485
"""Heights of the table top and of a train's reference point [m]."""


def circle_packet(stamp, seq=1, *, radius=0.12, speed=0.15, std=0.005):
    """A packet of a train on a circle; its vector may be changed."""
    times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
    angle = speed / radius * times
    x, y, z = 0.56 + radius * np.cos(angle), radius * np.sin(angle), np.full(KNOT_COUNT, TRAIN_Z)
    return pack_prediction(stamp, seq, np.column_stack([x, y, z, angle + np.pi / 2, np.full(KNOT_COUNT, std)]))


def with_fields(packet, **fields):
    """The packet with other values in some fields of the header."""
    packet = np.array(packet)
    for name, value in fields.items():
        packet[Prediction.get_fields().index(name)] = value
    return packet


def with_knots(packet, change):
    """The packet with the knots (n, 5) that a function makes of its own."""
    packet = np.array(packet)
    packet[PREDICTION_HEADER:] = np.ravel(change(prediction_knots(packet).copy()))
    return packet


def moved(*offset):
    """A change of knots: added to (x, y, z, yaw, std)."""
    return lambda knots: knots + np.array(offset)


def column(index, values):
    """A change of knots: other values in one column."""

    def change(knots):
        knots[:, index] = values
        return knots

    return change


_STEPS = np.arange(KNOT_COUNT)
BAD_PACKETS = {
    "knots of 1e308": (lambda p: with_knots(p, column(0, 1e308)), Rejection.OUTSIDE),
    "knots of -1e308 at the end": (lambda p: with_knots(p, column(1, -1e308 * (_STEPS > 20))), Rejection.TOO_FAST),
    "heights of -1e308": (lambda p: with_knots(p, column(2, np.where(_STEPS, -1e308, TRAIN_Z))), Rejection.BELOW_TABLE),
    "one knot NaN": (lambda p: with_knots(p, column(0, np.where(_STEPS > 29, np.nan, 0.5))), Rejection.NOT_FINITE),
    "a knot at infinity": (lambda p: with_knots(p, column(3, np.inf)), Rejection.NOT_FINITE),
    "all NaN": (lambda p: np.full_like(p, np.nan), Rejection.MALFORMED),
    "stamp NaN": (lambda p: with_fields(p, stamp=np.nan), Rejection.NOT_FINITE),
    "valid is 2": (lambda p: with_fields(p, valid=2.0), Rejection.MALFORMED),
    "valid is NaN": (lambda p: with_fields(p, valid=np.nan), Rejection.MALFORMED),
    "valid is negative": (lambda p: with_fields(p, valid=-1.0), Rejection.MALFORMED),
    "seq is negative": (lambda p: with_fields(p, seq=-1.0), Rejection.MALFORMED),
    "seq of 1e308": (lambda p: with_fields(p, seq=1e308), Rejection.MALFORMED),
    "a negative standard deviation": (lambda p: with_knots(p, column(4, -0.001)), Rejection.MALFORMED),
    "a standard deviation of 1e308": (lambda p: with_knots(p, column(4, 1e308)), Rejection.MALFORMED),
    "spacing of 1e300": (lambda p: with_fields(p, spacing=1e300), Rejection.SPACING),
    "spacing of 0": (lambda p: with_fields(p, spacing=0.0), Rejection.SPACING),
    "negative spacing": (lambda p: with_fields(p, spacing=-0.05), Rejection.SPACING),
    "spacing of 0.1": (lambda p: with_fields(p, spacing=0.1), Rejection.SPACING),
    "first knot later than the stamp": (
        lambda p: with_fields(p, first_time=Prediction(p).stamp + 0.1), Rejection.FIRST_TIME
    ),
    "stamp at the end of time": (lambda p: with_fields(p, stamp=2.0**63, first_time=2.0**63), Rejection.FUTURE),
    "stamp in the future": (lambda p: shifted(p, 0.5), Rejection.FUTURE),
    "stamp in the past": (lambda p: shifted(p, -2.0), Rejection.PAST),
    "stamp long ago": (lambda p: with_fields(p, stamp=-1e300, first_time=-1e300), Rejection.PAST),
    "path outside": (lambda p: with_knots(p, moved(0.5, 0, 0, 0, 0)), Rejection.OUTSIDE),
    "path in the air": (lambda p: with_knots(p, moved(0, 0, 0.3, 0, 0)), Rejection.OUTSIDE),
    "path below the table": (lambda p: with_knots(p, moved(0, 0, -0.5, 0, 0)), Rejection.OUTSIDE),
    "path a little below the table": (lambda p: with_knots(p, moved(0, 0, -0.05, 0, 0)), Rejection.BELOW_TABLE),
    "path that sinks": (lambda p: with_knots(p, column(2, TRAIN_Z - 0.02 * _STEPS)), Rejection.BELOW_TABLE),
    "path that sinks, vaguely": (
        lambda p: with_knots(with_knots(p, column(2, TRAIN_Z - 0.02 * _STEPS)), column(4, 1.0)), Rejection.BELOW_TABLE
    ),
    "a leap": (lambda p: with_knots(p, column(0, np.where(_STEPS > 3, 1.2, 0.5))), Rejection.TOO_FAST),
    "a fast object": (lambda p: with_knots(p, column(0, 0.4 + 0.15 * _STEPS)), Rejection.TOO_FAST),
    "a direction that leaps": (lambda p: with_knots(p, column(3, 3.2 * _STEPS)), Rejection.TURNING),
    "a direction of 1e300": (lambda p: with_knots(p, column(3, 1e300)), Rejection.TURNING),
}  # fmt: skip
"""{name: (function that spoils a good packet, why the arm rejects it)}; the arm's clock is 0.25 s past the stamp."""


def shifted(packet, time):
    """The packet with another stamp, and hence another first time [s]."""
    stamp = Prediction(packet).stamp + time
    return with_fields(packet, stamp=stamp, first_time=stamp)
