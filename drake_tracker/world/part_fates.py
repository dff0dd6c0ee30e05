"""What becomes of a part, decided from its true state and its contacts."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from drake_tracker.world.conveyor_config import BeltConfig, TrayConfig
from drake_tracker.world.tray import cell_at


class PartFate(IntEnum):
    """What has become of a part.

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
"""Height [m] above its place on the belt from which a part between both fingers counts as held."""
AT_REST = 0.02
"""Speed [m/s] below which a part rests."""
REST_TIME = 0.2
"""Time [s] for which it must rest before it counts as placed or dropped."""
CELL_TOLERANCE = 0.004
"""Largest difference [m] between the height of a part in a cell and that of one that stands on the cell's floor."""
TIPPED = np.deg2rad(10.0)
"""Tilt [rad] beyond which a part does not stand."""


@dataclass(frozen=True)
class PartView:
    """What the judge sees of a part at one time.

    Attributes:
        x: of the origin of P in W [m].
        y: of the origin of P in W [m].
        rise: height of the origin of P above its place on the belt [m].
        tilt: angle between z_P and the vertical [rad].
        speed: of the origin of P [m/s].
        fingers: number of fingers that touch it.
        on_belt: whether it touches the belt.
    """

    x: float
    y: float
    rise: float
    tilt: float
    speed: float
    fingers: int
    on_belt: bool


def is_held(view: PartView) -> bool:
    """Returns whether both fingers hold a part off the belt."""
    return view.fingers == 2 and not view.on_belt and view.rise >= HELD_HEIGHT


def is_carried(view: PartView) -> bool:
    """Returns whether a finger at least carries a part off the belt."""
    return view.fingers > 0 and not view.on_belt and view.rise >= HELD_HEIGHT


def next_fate(fate: PartFate, view: PartView, *, rested: float, belt: BeltConfig, tray: TrayConfig) -> PartFate:
    """Returns the fate of a part.

    Args:
        fate: until now.
        view: of the part now.
        rested: time for which the part has rested [s].
        belt: where the belt lies.
        tray: where the trays lie.
    """
    if is_held(view):
        return PartFate.HELD
    if fate is PartFate.UPSTREAM:
        return PartFate.ON_BELT if view.y >= belt.entry else fate
    if view.on_belt:
        if fate is PartFate.ON_BELT and view.y > belt.end:
            return PartFate.MISSED
        if fate in (PartFate.HELD, PartFate.PLACED) and view.fingers == 0:
            return PartFate.DROPPED
        return fate
    if view.fingers == 0 and rested >= REST_TIME:
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
