"""The LCM channels between the two processes; docs/reference/lcm.md describes them for authors of a driver.

A channel carries the values of a port of `HandEyeDiagram`, under the port's name: a vector as `lcmt_drake_signal`
(`encode_signal`), a camera's images as `lcmt_image_array`.
"""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from drake import lcmt_drake_signal

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import (
    ArmCommand,
    Centroid,
    Filtered,
    JawState,
    Prediction,
    Regions,
    TrackPoint,
    TrackPoints,
)
from drake_tracker.core.timing import ESTIMATOR_SLOT, LINK_SLOT, SERVO_PERIOD, VISION_PERIOD, vision_slot

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
"""LCM's own group and port; ttl 0 stands for this machine only, see `open_bus`."""
PREFIX = "DRAKE_TRACKER_"
CAMERAS = ("camera_left", "camera_right")
"""Ports with the images of the cameras."""

POINT = ("point",)
"""Ports that the host receives when points are sent to it."""
TRACKS = ("tracks",)
"""Ports that the host receives when the tracks of several objects are sent to it."""
FROM_VISION = ("point", "centroid_left", "centroid_right")
"""Ports that the host computes from images and sends for the log."""
FROM_TRACKER = (*TRACKS, "regions_left", "regions_right")
"""Further ports of this kind with a vision of several objects."""
FROM_HOST = ("prediction", "filtered")
"""Ports that the host always sends."""
FROM_ARM = ("arm_state", "jaws", "q_commanded", "command")
"""Ports that the arm sends to any listener. A host that tracks several objects reads the first two."""
SENDER = ("run", "host")
"""Fields that may follow the fields of a vector: identifiers of the arm's run and of the host. 0 stands for none."""


@dataclass(frozen=True)
class Vector:
    """A channel of vectors.

    Attributes:
        fields: names of the fields, in order.
        period: period at which the vector is published [s].
        offset: time of the first publication [s].
    """

    fields: tuple[str, ...]
    period: float
    offset: float


def channel_of(port: str) -> str:
    """Returns the name of a port's channel."""
    return PREFIX + port.upper()


def vectors(time_step: float, num_joints: int = 6) -> dict[str, Vector]:
    """Returns {port: `Vector`} of every channel of vectors.

    The host sends its results after its own slot; the messages that it reads are sent just before its slot.

    Args:
        time_step: the plant's step [s], of which the slots are fractions.
        num_joints: number of the arm's joints.
    """
    q, v = ([f"{letter}{i + 1}" for i in range(num_joints)] for letter in "qv")
    after_vision = (VISION_PERIOD, vision_slot(ESTIMATOR_SLOT, time_step))
    after_host = (VISION_PERIOD, vision_slot(LINK_SLOT, time_step))
    at_once = (VISION_PERIOD, 0.0)
    # Sampled as the joint spline samples them: at the end of the period in which they were computed.
    set_point = (SERVO_PERIOD, 0.0)
    rows = {
        "point": (TrackPoint.get_fields(), *after_vision),
        "centroid_left": (Centroid.get_fields(), *after_vision),
        "centroid_right": (Centroid.get_fields(), *after_vision),
        "tracks": (TrackPoints.get_fields(), *after_vision),
        "regions_left": (Regions.get_fields(), *after_vision),
        "regions_right": (Regions.get_fields(), *after_vision),
        "prediction": (Prediction.get_fields(), *after_host),
        "filtered": (Filtered.get_fields(), *after_host),
        "arm_state": (q + v, *at_once),
        "jaws": (JawState.get_fields(), *at_once),
        "q_commanded": (q, *set_point),
        "command": (ArmCommand.get_fields(), *set_point),
    }
    return {port: Vector(tuple(fields), period, offset) for port, (fields, period, offset) in rows.items()}


def new_identifier() -> int:
    """Returns an identifier for a run or a host, drawn at random, between 1 and 2^32."""
    return 1 + secrets.randbelow(2**32)


def encode_signal(
    values: Sequence[float] | np.ndarray, fields: Sequence[str], time: float, sender: Sequence[float] = ()
) -> lcmt_drake_signal:
    """Returns the message of a vector: ``val`` holds the values and ``coord`` the names of the fields.

    Args:
        values: the vector.
        fields: names of its fields.
        time: the sender's time [s]; ``timestamp`` is in milliseconds, as in Drake.
        sender: values of `SENDER`, or nothing.
    """
    message = lcmt_drake_signal()
    message.val = [float(value) for value in (*values, *sender)]
    message.coord = [*fields, *SENDER[: len(sender)]]
    message.dim = len(message.val)
    message.timestamp = round(1e3 * time)
    return message


def decode_signal(message: lcmt_drake_signal, fields: Sequence[str]) -> np.ndarray | None:
    """Returns the vector in a message, without `SENDER`, read-only, or None when the message has other fields.

    Args:
        message: the message.
        fields: names of the expected fields.
    """
    names = list(message.coord)
    if message.dim != len(names) or names not in (list(fields), [*fields, *SENDER]):
        return None
    return read_only(np.array(message.val[: len(fields)]))


def sender_of(message: lcmt_drake_signal) -> tuple[float, float]:
    """Returns the values of `SENDER` in the message of a vector; 0 for what it does not name."""
    return tuple(message.val[-2:]) if tuple(message.coord[-2:]) == SENDER else (0.0, 0.0)
