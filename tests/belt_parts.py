"""Messages of parts on a belt, for tests of the host and of its vision."""

import numpy as np

from drake_tracker.core.messages import PART_FIELDS, PartTracks, message_rows, message_size
from drake_tracker.core.part_kinds import PART_SHAPES

BELT_HEIGHT = 0.45


def part_tracks(stamp, parts, std=0.001):
    """A `PartTracks` vector of parts (number, kind, x, y, yaw), all seen at its stamp."""
    vector = np.zeros(message_size(PartTracks))
    header = PartTracks(vector)
    header.stamp, header.valid = stamp, 1.0
    for slot, (number, kind, x, y, yaw) in zip(message_rows(vector, PART_FIELDS), parts):
        z = BELT_HEIGHT + 0.5 * PART_SHAPES[kind].height
        slot[:] = [number, kind, x, y, z, yaw, std**2, std**2, 1e-4, stamp]
    return vector


def part_state(kind, x, y, yaw, rise=0.0):
    """The 13 numbers of a free body."""
    z = BELT_HEIGHT + 0.5 * PART_SHAPES[kind].height + rise
    return [np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw), x, y, z, *np.zeros(6)]
