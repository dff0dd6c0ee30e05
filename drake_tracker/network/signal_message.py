"""A vector with named fields as an `lcmt_drake_signal`, and back."""

import numpy as np
from drake import lcmt_drake_signal


def encode_signal(values, fields, time):
    """Returns the `lcmt_drake_signal` of a vector: ``val`` the values, ``coord`` the names of its ``fields``,
    ``timestamp`` the sender's time in ms, as Drake has it. ``time`` in [s].
    """
    message = lcmt_drake_signal()
    message.dim = len(fields)
    message.val = [float(value) for value in values]
    message.coord = list(fields)
    message.timestamp = round(1e3 * time)
    return message


def decode_signal(message, fields):
    """Returns the vector (read-only) in an `lcmt_drake_signal`, None when its fields are not these ``fields``."""
    if message.dim != len(fields) or list(message.coord) != list(fields):
        return None
    values = np.array(message.val)
    values.setflags(write=False)
    return values
