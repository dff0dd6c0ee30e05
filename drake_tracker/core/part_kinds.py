"""The parts that the conveyor carries: their dimensions, which vision, dispatch, hand and world must know alike."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

_SIDES = 48
_STEP = 0.00025
"""Distance across the belt at which outlines are compared [m]."""


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


def part_outline(kind: PartKind) -> np.ndarray:
    """Returns the corners of the outline of a part, counter-clockwise in P, shape (n, 2) [m]."""
    shape = PART_SHAPES[kind]
    half_length, half_width = 0.5 * shape.length, 0.5 * shape.width
    if kind is PartKind.DISC:
        angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
        return half_width * np.column_stack([np.cos(angle), np.sin(angle)])
    if kind is PartKind.BOX:
        return np.array(
            [
                [-half_length, -half_width],
                [half_length, -half_width],
                [half_length, half_width],
                [-half_length, half_width],
            ]
        )
    tip, inner = ELL_LEG - half_width, half_length - shape.width
    corners = np.array(
        [
            [-half_length, -half_width],
            [half_length, -half_width],
            [half_length, tip],
            [inner, tip],
            [inner, half_width],
            [-half_length, half_width],
        ]
    )
    return corners + [shape.middle, 0.0]


def solids(kind: PartKind) -> tuple[tuple[tuple[float, float], tuple[float, float]], ...]:
    """Returns the centre (x, y) and the size (along x, along y) in P of each cuboid of a part, without overlap [m].

    A disc has one, which contains it.
    """
    shape = PART_SHAPES[kind]
    long_leg = ((shape.middle, 0.0), (shape.length, shape.width))
    if kind is not PartKind.ELL:
        return (long_leg,)
    reach = ELL_LEG - shape.width
    short_leg = ((shape.middle + 0.5 * (shape.length - shape.width), 0.5 * (shape.width + reach)), (shape.width, reach))
    return long_leg, short_leg


def placed_outline(kind: PartKind, x: float, y: float, yaw: float) -> np.ndarray:
    """Returns the outline of a part at a place, shape (n, 2) [m].

    Args:
        kind: of the part.
        x: of the origin of P [m].
        y: of the origin of P [m].
        yaw: direction of x_P, counted from x towards y [rad].
    """
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    return part_outline(kind) @ turn + [x, y]


def touching_distance(ahead: np.ndarray, behind: np.ndarray) -> float:
    """Returns the distance along -y by which the rear outline must be moved so that it just touches the front outline
    [m].

    Args:
        ahead: outline of the part with the larger y, shape (n, 2) [m].
        behind: outline of the other part, shape (m, 2) [m].

    Returns minus infinity when the two outlines pass each other, whatever their distance along y.
    """
    low = max(ahead[:, 0].min(), behind[:, 0].min())
    high = min(ahead[:, 0].max(), behind[:, 0].max())
    if high < low:
        return -np.inf
    x = np.append(np.arange(low, high, _STEP), high)
    return float(np.nanmax(np.nanmax(_crossings(behind, x), axis=0) - np.nanmin(_crossings(ahead, x), axis=0)))


def _crossings(outline: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Returns the y at which the edges of an outline cross lines of constant x, shape (edges, len(x)), else NaN."""
    begin, end = outline, np.roll(outline, -1, axis=0)
    run = (end - begin)[:, :1]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (x - begin[:, :1]) / run
    crossing = begin[:, 1:] + share * (end - begin)[:, 1:]
    return np.where((share >= 0.0) & (share <= 1.0), crossing, np.nan)
