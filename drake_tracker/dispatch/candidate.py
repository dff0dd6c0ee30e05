"""The input of a dispatcher: parts on a moving belt, the hand, and the cells into which the parts go.

All positions are in W: x across the belt, +y the direction in which the belt moves.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.messages import PART_FIELDS, PartTracks, message_rows
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.estimation.belt import PartPoint

STAMP_TOLERANCE = 0.001
"""Time by which a stamp may be later than the present [s]."""
JAW_HALF_LENGTH = 0.024
"""Half the extent of the open jaws along the pads [m]."""
JAW_HALF_WIDTH = 0.060
"""Half the extent of the open jaws, fingers included, along their opening [m]."""


@dataclass(frozen=True)
class Candidate:
    """A part on the belt at a time `now`.

    Attributes:
        number: number of its track, unique and larger for parts seen later.
        kind: kind of the part, as a number.
        x: position across the belt [m].
        y: position along the belt [m].
        yaw: orientation about W's z axis [rad].
        v: speed along +y [m/s].
        std: standard deviation of the position [m].
        clear: distance from its outline to that of the nearest other part [m].
    """

    number: int
    kind: int
    x: float
    y: float
    yaw: float
    v: float
    std: float
    clear: float


@dataclass(frozen=True)
class FreeHand:
    """Where and when the hand is free to go for the next part.

    Attributes:
        x: position across the belt [m].
        y: position along the belt [m].
        free_at: time from which the hand is free [s].
    """

    x: float
    y: float
    free_at: float


@dataclass(frozen=True)
class Cell:
    """A place for one part.

    Attributes:
        x: position across the belt [m].
        y: position along the belt [m].
    """

    x: float
    y: float


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


def jaw_clearance(x: float, y: float, yaw: float, other_x: float, other_y: float, other_radius: float) -> float:
    """Returns the distance between the open jaws around a part and another part [m], negative where they overlap.

    Args:
        x: of the part to pick [m].
        y: of the part to pick [m].
        yaw: direction of its x_P, along the pads [rad].
        other_x: of the other part [m].
        other_y: of the other part [m].
        other_radius: of a circle around the other part [m].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = other_x - x, other_y - y
    along, across = abs(c * dx + s * dy), abs(c * dy - s * dx)
    beyond = max(along - JAW_HALF_LENGTH, 0.0), max(across - JAW_HALF_WIDTH, 0.0)
    return math.hypot(*beyond) - other_radius
