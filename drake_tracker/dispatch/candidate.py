"""What a dispatcher decides about: parts on a moving belt, the hand, and the cells into which the parts go.

All positions are in W: x across the belt, +y the direction in which the belt moves.
"""

from dataclasses import dataclass


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
