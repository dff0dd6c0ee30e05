"""The fate of a part, decided from its true state and its contacts."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from drake_tracker.world.conveyor.conveyor_config import BeltConfig, TrayConfig, cell_at


class PartFate(IntEnum):
    """The fate of a part.

    UPSTREAM: it has not arrived yet. ON_BELT: it lies on the belt. HELD: both fingers hold it off the belt, or they did
    and it has not come to rest since. PLACED: it rests in a cell of a tray. MISSED: the belt has carried it past the
    end. DROPPED: it rests anywhere else, or lies on the belt again after it was held.
    """

    UPSTREAM = 0
    ON_BELT = 1
    HELD = 2
    PLACED = 3
    MISSED = 4
    DROPPED = 5


HELD_HEIGHT = 0.010
"""Height [m] above its place on the belt from which a part that the fingers touch counts as held."""
AT_REST = 0.02
"""Speed [m/s] below which a part rests."""
REST_TIME = 0.2
"""Time [s] for which it must rest before it counts as placed or dropped."""
CELL_TOLERANCE = 0.004
"""Largest difference [m] between the height of a part in a cell and the height of a part on the floor of the cell."""
TIPPED = np.deg2rad(10.0)
"""Tilt [rad] beyond which a part does not stand."""


@dataclass(frozen=True)
class PartView:
    """The judge's view of a part at one time.

    Attributes:
        x: of the origin of P in W [m].
        y: of the origin of P in W [m].
        rise: height of the origin of P above its place on the belt [m].
        tilt: angle between z_P and the vertical [rad].
        speed: of the origin of P [m/s].
        fingers: numbers of the fingers that touch it, 0 and 1.
        on_belt: whether it touches the belt.
    """

    x: float
    y: float
    rise: float
    tilt: float
    speed: float
    fingers: frozenset[int]
    on_belt: bool


def held_parts(views: Sequence[PartView]) -> list[int]:
    """Returns the indices of the parts that the fingers hold off the belt: more than one part if they are between them.

    Args:
        views: of all parts.
    """
    carried = [k for k, view in enumerate(views) if view.fingers and not view.on_belt and view.rise >= HELD_HEIGHT]
    fingers = frozenset().union(*(views[k].fingers for k in carried))
    return carried if len(fingers) == 2 else []


def next_fate(
    fate: PartFate, view: PartView, *, held: bool, rested: float, belt: BeltConfig, tray: TrayConfig
) -> PartFate:
    """Returns the fate of a part.

    Args:
        fate: until now.
        view: of the part now.
        held: whether the fingers hold it, as `held_parts` says.
        rested: time for which the part has rested [s].
        belt: where the belt lies.
        tray: where the trays lie.
    """
    if held:
        return PartFate.HELD
    if fate is PartFate.UPSTREAM:
        return PartFate.ON_BELT if view.y >= belt.entry else fate
    if view.on_belt:
        if fate is PartFate.ON_BELT and view.y > belt.end:
            return PartFate.MISSED
        if fate in (PartFate.HELD, PartFate.PLACED) and not view.fingers:
            return PartFate.DROPPED
        return fate
    if not view.fingers and rested >= REST_TIME:
        if stands_in_cell(view, tray):
            return PartFate.PLACED
        if fate is not PartFate.MISSED and not _over_belt(view, belt):
            return PartFate.DROPPED
    return fate


def stands_in_cell(view: PartView, tray: TrayConfig) -> bool:
    """Returns whether a part stands upright on the floor of a cell."""
    stands = abs(view.rise) <= CELL_TOLERANCE and view.tilt <= TIPPED
    return stands and cell_at(tray, view.x, view.y) is not None


def _over_belt(view: PartView, belt: BeltConfig) -> bool:
    """Returns whether a part is over the belt, where it may lie on another part."""
    return abs(view.x - belt.middle) <= 0.5 * belt.width and view.rise > -HELD_HEIGHT
