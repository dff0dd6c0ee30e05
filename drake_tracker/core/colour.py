"""Colours of scenarios, written as "#rrggbb"."""

import re

import numpy as np

_HEX = re.compile(r"#[0-9a-fA-F]{6}")
COLOUR_RULE = "must be #rrggbb with hexadecimal digits"
"""What a colour of a scenario must be, for messages."""


def is_colour(text: str) -> bool:
    """Returns whether a text is a colour, such as "#d02020"."""
    return _HEX.fullmatch(text) is not None


def rgb(colour: str) -> np.ndarray:
    """Returns red, green and blue of a colour, from 0 to 1, shape (3,).

    Args:
        colour: a text for which `is_colour` is true.
    """
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
