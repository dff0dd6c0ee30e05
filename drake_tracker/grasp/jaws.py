"""The hand's knowledge of its jaws, and their motion."""

from typing import Any

WIDTH_TOLERANCE = 0.010
"""Jaws that stop within this distance [m] of the object's width have stopped at the object."""
FORCE_SHARE = 0.6
"""Fraction of the grip force that must be measured for a grip to be accepted."""
STILL = 0.010
"""Jaws whose opening changes more slowly than this [m/s] stand still."""
GRIP_CONFIRMED = 0.06
"""The jaws hold something once they have stood still under force for this long [s]."""
OBLIQUE_CONFIRMED = 0.15
"""The same for jaws that are further open than the object is wide, between which the object may still turn straight
[s]."""


def feels_grip(jaws: Any, width: float, grip_force: float) -> bool:
    """Returns whether the jaws press on an object.

    Args:
        jaws: a `JawState`.
        width: of the object between the jaws [m].
        grip_force: largest force of the drive on each pad [N].
    """
    return abs(jaws.width - width) <= WIDTH_TOLERANCE and jaws.force >= FORCE_SHARE * grip_force


def feels_oblique_grip(jaws: Any, width: float, opening: float, grip_force: float) -> bool:
    """Returns whether the jaws press on an object that lies obliquely between them.

    Args:
        jaws: a `JawState`.
        width: of the object, measured straight across [m].
        opening: of the jaws before the grasp [m].
        grip_force: largest force of the drive on each pad [N].
    """
    between = width + WIDTH_TOLERANCE < jaws.width < opening - WIDTH_TOLERANCE
    return bool(between and jaws.force >= FORCE_SHARE * grip_force)


def closed_on_nothing(jaws: Any, width: float) -> bool:
    """Returns whether the jaws are closer together than an object between them would let them be.

    Args:
        jaws: a `JawState`.
        width: of the object between the jaws [m].
    """
    return bool(jaws.width < width - WIDTH_TOLERANCE)


def next_opening(opening: float, goal: float, speed: float, period: float) -> float:
    """Returns the opening of the jaws that is asked for at the next tick [m].

    Args:
        opening: the one that is asked for now [m].
        goal: the one at the end [m].
        speed: rate at which the opening changes [m/s].
        period: time between ticks [s].
    """
    step = speed * period
    return opening + min(max(goal - opening, -step), step)
