"""Hues of colours, and how much they differ."""

import colorsys
from collections.abc import Sequence

COLOURLESS = 0.15
"""Saturation below which a colour has no hue."""


def hue(colour: Sequence[float]) -> float | None:
    """Returns the hue [deg] of a colour (red, green, blue), each 0 to 255, None for one that is nearly grey."""
    angle, saturation, _ = colorsys.rgb_to_hsv(*(value / 255.0 for value in colour))
    return 360.0 * angle if saturation >= COLOURLESS else None


def hue_distance(one: float | None, other: float | None) -> float:
    """Returns the angle between two hues [deg]: 0 between two greys, 180 between a grey and a colour."""
    if one is None or other is None:
        return 0.0 if one is other else 180.0
    turn = abs(one - other) % 360.0
    return min(turn, 360.0 - turn)
