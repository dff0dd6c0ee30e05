"""The parts that the conveyor carries: their dimensions, which vision, dispatch, hand and world must know alike."""

from dataclasses import dataclass
from enum import IntEnum


class PartKind(IntEnum):
    """Kinds of parts, as in messages; 0 is none.

    BOX: a cuboid. DISC: a cylinder that lies flat. ELL: two legs at a right angle.
    """

    NONE = 0
    BOX = 1
    DISC = 2
    ELL = 3


@dataclass(frozen=True)
class PartShape:
    """Dimensions of a kind of part.

    Frame P of a part: its origin is between the jaws, at half the height; x along the jaws, z up. The jaws hold an
    `ELL` beside its short leg.

    Attributes:
        length: extent along x_P [m].
        middle: x_P of the middle of this extent [m].
        width: extent between the jaws, along y_P [m].
        height: extent along z_P [m].
        turns: number of orientations about z_P that look the same; 0: any orientation does.
        radius: distance from the origin to the farthest corner, seen from above [m].
    """

    length: float
    middle: float
    width: float
    height: float
    turns: int
    radius: float


ELL_LEG = 0.035
"""Length of the short leg of an `ELL`, measured along its outer edge [m]."""

PART_SHAPES = {
    PartKind.BOX: PartShape(0.050, 0.0, 0.030, 0.030, 2, 0.0292),
    PartKind.DISC: PartShape(0.040, 0.0, 0.040, 0.025, 0, 0.020),
    PartKind.ELL: PartShape(0.050, 0.016, 0.018, 0.025, 1, 0.0486),
}
"""{kind: its dimensions}. The long leg of an `ELL` lies along x_P; its short leg begins at the end at +x and points
along +y_P."""
