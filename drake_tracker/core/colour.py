"""Colours of scenarios, written as "#rrggbb"."""

import colorsys
import re
from collections.abc import Sequence

import numpy as np

_HEX = re.compile(r"#[0-9a-fA-F]{6}")
COLOUR_RULE = "must be #rrggbb with hexadecimal digits"
"""Required form of a colour in a scenario, for messages."""
COLOURLESS = 0.15
"""Saturation below which a colour has no hue."""


def is_colour(text: str) -> bool:
    """Returns whether a text is a colour, such as "#d02020"."""
    return _HEX.fullmatch(text) is not None


def rgb(colour: str) -> np.ndarray:
    """Returns red, green and blue of a colour, from 0 to 1, shape (3,).

    Args:
        colour: a text for which `is_colour` is true.
    """
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


def hue(colour: Sequence[float]) -> float | None:
    """Returns the hue [deg] of a colour (red, green, blue), each 0 to 255, None for a colour that is nearly grey."""
    angle, saturation, _ = colorsys.rgb_to_hsv(*(value / 255.0 for value in colour))
    return 360.0 * angle if saturation >= COLOURLESS else None


def hue_distance(one: float | None, other: float | None) -> float:
    """Returns the angle between two hues [deg]: 0 between two greys, 180 between a grey and a colour."""
    if one is None or other is None:
        return 0.0 if one is other else 180.0
    turn = abs(one - other) % 360.0
    return min(turn, 360.0 - turn)
