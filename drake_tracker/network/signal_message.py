"""Converts a vector with named fields to an `lcmt_drake_signal`, and back."""

from collections.abc import Sequence

import numpy as np
from drake import lcmt_drake_signal

from drake_tracker.core.frozen_state import read_only


def encode_signal(values: Sequence[float] | np.ndarray, fields: Sequence[str], time: float) -> lcmt_drake_signal:
    """Returns the message of a vector: ``val`` holds the values and ``coord`` the names of the fields.

    Args:
        values: the vector.
        fields: names of its fields.
        time: the sender's time [s]; ``timestamp`` is in milliseconds, as in Drake.
    """
    message = lcmt_drake_signal()
    message.dim = len(fields)
    message.val = [float(value) for value in values]
    message.coord = list(fields)
    message.timestamp = round(1e3 * time)
    return message


def decode_signal(message: lcmt_drake_signal, fields: Sequence[str]) -> np.ndarray | None:
    """Returns the vector in a message, read-only, or None when the message has other fields.

    Args:
        message: the message.
        fields: names of the expected fields.
    """
    if message.dim != len(fields) or list(message.coord) != list(fields):
        return None
    return read_only(np.array(message.val))
