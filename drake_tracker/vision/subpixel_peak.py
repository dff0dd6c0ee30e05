"""Where a maximum lies between samples."""

import math

import numpy as np


def peak_offset(values: np.ndarray, index: int, limit: float = math.inf) -> float:
    """Returns where the parabola through a value and its neighbours has its maximum, from the index on.

    Args:
        values: samples 1 apart, shape (n,); computed in their own type.
        index: of the largest value. At either end there is no parabola, and the result is 0, as without a maximum.
        limit: largest distance.
    """
    if not 0 < index < len(values) - 1:
        return 0.0
    before, at, after = values[index - 1 : index + 2]
    bend = before - 2.0 * at + after
    return 0.0 if bend >= 0.0 else min(max(0.5 * (before - after) / bend, -limit), limit)
