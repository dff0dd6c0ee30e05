"""Which orders a hand may carry out. An order may come from any program that joins the link."""

from typing import Any

import numpy as np

from drake_tracker.core.part_kinds import PART_SHAPES

LARGEST_YAW = 1e3
"""Largest direction of a place [rad]."""


def may_carry_out(order: Any, places: np.ndarray, jaw_opening: float) -> bool:
    """Returns whether a hand may carry out an order; one that it may not is ignored, as if it had not arrived.

    Every number is finite; there is a part of a known kind, which fits between the open jaws; and its place is where
    parts may be put down.

    Args:
        order: a `PickOrder`.
        places: lowest and highest corner in W of the box in which parts may be put down, shape (2, 3) [m].
        jaw_opening: opening of the jaws before the pick [m].
    """
    if not np.isfinite(order[:]).all() or order.valid != 1.0 or order.number <= 0.0:
        return False
    place = np.array([order.place_x, order.place_y, order.place_z])
    return bool(
        order.kind in PART_SHAPES
        and 0.0 < order.width < jaw_opening
        and abs(order.place_yaw) <= LARGEST_YAW
        and (place >= places[0]).all()
        and (place <= places[1]).all()
    )
