"""Reads the message with the parts that vision sees."""

import numpy as np

from drake_tracker.core.messages import PART_FIELDS, PartTracks, message_rows
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.estimation.belt import PartPoint

STAMP_TOLERANCE = 0.001
"""Time by which a stamp may be later than the present [s]."""


def seen_parts(message: np.ndarray, last: float, now: float) -> tuple[float | None, list[PartPoint]]:
    """Returns the stamp of a `PartTracks` and the parts that are seen in it. Parts of unknown kinds are ignored.

    Args:
        message: the message.
        last: stamp of the last one [s].
        now: the time [s].

    The stamp is None when the message is not newer than the last one, or from the future.
    """
    header = PartTracks(message)
    if not header.valid or not last < header.stamp <= now + STAMP_TOLERANCE:
        return None, []
    return float(header.stamp), [
        PartPoint(int(row[0]), PartKind(int(row[1])), *row[2:9].tolist())
        for row in message_rows(message, PART_FIELDS)
        if np.isfinite(row).all() and row[0] > 0.0 and row[9] >= header.stamp and row[1] in PART_SHAPES
    ]
