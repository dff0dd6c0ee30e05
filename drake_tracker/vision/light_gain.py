"""How much the light changed between two images, so that a flicker of all lamps is not taken for motion."""

import math

GAIN_LIMITS = (2 / 3, 3 / 2)
"""When brightness changes by more between two images, the light was switched and no motion can be told."""


def light_gain(level0, level1):
    """Returns what to multiply an image of the total brightness ``level0`` by to match another of ``level1``.

    None when the light changed by more than `GAIN_LIMITS`.
    """
    gain = level1 / level0 if level0 > 0.0 else math.inf
    return gain if GAIN_LIMITS[0] < gain < GAIN_LIMITS[1] else None
