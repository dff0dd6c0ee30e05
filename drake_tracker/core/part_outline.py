"""Outlines of the parts as seen from above, and how close two of them come along the belt."""

import numpy as np

from drake_tracker.core.part_kinds import ELL_LEG, PART_SHAPES, PartKind

_SIDES = 48
_STEP = 0.00025
"""Distance across the belt at which outlines are compared [m]."""


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
    """Returns how far the outline behind must be moved along -y so that it just touches the one ahead [m].

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
