"""Whether there is room for the jaws beside a part."""

import math

JAW_HALF_LENGTH = 0.024
"""Half the extent of the open jaws along the pads [m]."""
JAW_HALF_WIDTH = 0.060
"""Half the extent of the open jaws, fingers included, along their opening [m]."""


def jaw_clearance(x: float, y: float, yaw: float, other_x: float, other_y: float, other_radius: float) -> float:
    """Returns the distance between the open jaws around a part and another part [m], negative where they overlap.

    Args:
        x: of the part to pick [m].
        y: of the part to pick [m].
        yaw: direction of its x_P, along the pads [rad].
        other_x: of the other part [m].
        other_y: of the other part [m].
        other_radius: of a circle around the other part [m].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = other_x - x, other_y - y
    along, across = abs(c * dx + s * dy), abs(c * dy - s * dx)
    beyond = max(along - JAW_HALF_LENGTH, 0.0), max(across - JAW_HALF_WIDTH, 0.0)
    return math.hypot(*beyond) - other_radius
