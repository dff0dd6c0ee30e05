"""The latency that agrees with most images."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

_AGREED = 0.9
"""Share of the largest number of agreeing images above which a latency counts as possible."""
_TO_DEVIATION = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""
_MIDDLE = 0.95
"""Share of the images from which the range of instants at which they fall is found."""


@dataclass(frozen=True)
class Latency:
    """A measured latency.

    Attributes:
        seconds: from the light to the stamp [s].
        uncertainty: two standard deviations of the latency, plus half of what the bounds leave open because the images
            do not fall at all instants between them [s].
        spread: standard deviation of the latency of a single image, from the median absolute deviation [s].
        images: number of images used.
    """

    seconds: float
    uncertainty: float
    spread: float
    images: int


def estimate_latency(lowest: ArrayLike, highest: ArrayLike) -> Latency:
    """Returns the `Latency` that lies within the bounds of most images.

    Each image says between which bounds the latency lies. The best latency is the middle of all that agree with nearly
    as many images as any does. Images at all instants of the screen's refresh narrow the range, and false readings do
    not move it.

    Args:
        lowest: lower bound of each image [s], shape (n,).
        highest: upper bound of each image [s], shape (n,).
    """
    low, high = np.asarray(lowest, dtype=float), np.asarray(highest, dtype=float)
    edges = np.sort(np.concatenate([low, high]))
    middles = 0.5 * (edges[:-1] + edges[1:])
    agreeing = np.searchsorted(np.sort(low), middles, "right") - np.searchsorted(np.sort(high), middles, "left")
    possible = np.flatnonzero(agreeing >= _AGREED * agreeing.max())
    first, last = edges[possible[0]], edges[possible[-1] + 1]
    centre = 0.5 * (first + last)
    off = 0.5 * (low + high) - centre
    spread = _TO_DEVIATION * float(np.median(np.abs(off - np.median(off))))
    agrees = (low <= centre) & (centre <= high)
    width, count = np.median(high - low), agrees.sum()
    covered = np.ptp(np.quantile(high[agrees], [0.5 - 0.5 * _MIDDLE, 0.5 + 0.5 * _MIDDLE])) / _MIDDLE
    uncertainty = 2.0 * off[agrees].std() / np.sqrt(count) + 0.5 * max(0.0, width - covered)
    return Latency(float(centre), float(uncertainty), spread, len(low))
