"""The vector messages of the conveyor's world."""

from enum import IntEnum

from pydrake.common.containers import namedview


class PartFate(IntEnum):
    """What has become of a part.

    UPSTREAM: it has not arrived yet. ON_BELT: it lies on the belt. HELD: the fingers hold it off the belt, or they did
    and it has not come to rest since. PLACED: it rests in a cell of a tray. MISSED: the belt has carried it past the
    end. DROPPED: it rests anywhere else, or lies on the belt again after it was held.
    """

    UPSTREAM = 0
    ON_BELT = 1
    HELD = 2
    PLACED = 3
    MISSED = 4
    DROPPED = 5


PickVerdict = namedview(
    "PickVerdict",
    ["coming", "arrived", "picked", "placed", "missed", "dropped", "doubles", "held"]
    + ["belt_touched", "tray_touched", "table_touched", "self_touched"],
)
"""The judge's findings on the parts: numbers of parts that have not arrived yet, that have arrived, that were ever held
off the belt, and that are placed, missed and dropped now (`PartFate`); number of times at which the fingers began to
hold a second part; number of the part that they hold off the belt, from 1 (0: none); and 1 once the arm touched the belt, a tray, table or floor, or one of its links another."""
