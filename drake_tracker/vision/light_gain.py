"""The change of illumination between two images, so that flicker of all lamps does not count as motion."""

import math

GAIN_LIMITS = (2 / 3, 3 / 2)
"""When the brightness changes by a larger factor between two images, the light was switched: no motion can be found."""

SAME_LIGHT = 0.004
"""Changes of the brightness below this share are not compensated."""


def light_gain(level0: float, level1: float) -> float | None:
    """Returns the factor that scales an image of total brightness ``level0`` to another image of ``level1``.

    Args:
        level0: brightness of the earlier image, in any unit.
        level1: brightness of the later image, in the same unit.

    Returns None when the factor is outside `GAIN_LIMITS`.
    """
    gain = level1 / level0 if level0 > 0.0 else math.inf
    return gain if GAIN_LIMITS[0] < gain < GAIN_LIMITS[1] else None
