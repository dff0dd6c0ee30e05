"""Chooses the images of recordings whose rate varies, so that each cycle of vision has one."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter

from drake_tracker.footage.footage import Footage
from drake_tracker.footage.frame_clock import FrameClock

_FACTORS = (1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Periods that are tried, as multiples of the usual one."""
_REGULAR = 0.97
"""Share of the cycles with an image from which on a recording is regular, up to dropped images."""
_STRETCH = 0.5
"""Length of the stretches in which points are looked for [s]."""
_MORE_STRETCHES, _MORE_POINTS = 0.02, 1.1
"""A longer period must give points in this share more of the stretches, or this factor more points."""
_STEPS = 9
"""Number of steps between images whose median is the rate at that time."""


def even_out(
    footage: Sequence[Footage], clocks: Sequence[FrameClock]
) -> tuple[list[Footage], list[FrameClock], list[str]]:
    """Returns the images to use, their clocks, and one line for each recording whose rate varies.

    A point needs images in three cycles in a row. If a camera slows down, the usual period leaves cycles without an
    image, and hence long stretches without a point. A longer period is used if it gives points in more of the
    stretches. Each cycle then has the image that is nearest to it, and the images between are left out.

    Args:
        footage: of one or two cameras; live cameras, and their recordings, are returned unchanged.
        clocks: of the cameras, with the usual period of the first.
    """
    taken = [each.times for each in footage if each.times is not None and each.rate is None]
    period = clocks[0].period
    if len(taken) < len(footage) or all(
        len(np.unique(c := _cycles(each, period))) >= _REGULAR * (c[-1] + 1) for each in taken
    ):
        return list(footage), list(clocks), []
    best, (stretches, points) = 1.0, _judge(taken, period)
    for factor in _FACTORS[1:]:
        covered, count = _judge(taken, factor * period)
        more = covered > stretches + _MORE_STRETCHES
        if more or (covered > stretches - _MORE_STRETCHES and count > _MORE_POINTS * points):
            best, stretches, points = factor, covered, count
    if best == 1.0:
        return list(footage), list(clocks), []
    period *= best
    lines = [line for each, times in zip(footage, taken) if (line := _describe(each.name, times, period)) is not None]
    kept = [each.only(_nearest(times, period)) for each, times in zip(footage, taken)]
    return kept, [FrameClock(period, float(times[0])) for times in taken], lines


def _cycles(times: np.ndarray, period: float) -> np.ndarray:
    """Returns the number (n,) of the cycle nearest to each of the times [s], counted from the first."""
    return np.floor((times - times[0]) / period + 0.5).astype(int)


def _judge(taken: Sequence[np.ndarray], period: float) -> tuple[float, int]:
    """Returns (share of the stretches with a point, number of points) of the worst recording."""
    results = []
    for times in taken:
        cycles = np.unique(_cycles(times, period))
        points = cycles[1:-1][(cycles[2:] - cycles[:-2]) == 2]
        stretches = max(1, int((times[-1] - times[0]) / _STRETCH))
        found = np.unique((points * period / _STRETCH).astype(int))
        results.append((float((found < stretches).sum()) / stretches, len(points)))
    return min(results)


def _nearest(times: np.ndarray, period: float) -> np.ndarray:
    """Returns which of the images, booleans (n,), is the nearest one to its cycle."""
    cycles = _cycles(times, period)
    distance = np.abs(times - times[0] - cycles * period)
    order = np.lexsort((distance, cycles))
    _, first = np.unique(cycles[order], return_index=True)
    kept = np.zeros(len(times), bool)
    kept[order[first]] = True
    return kept


def _describe(name: str, times: np.ndarray, period: float) -> str | None:
    """Returns one line on the rate of a recording, None if the rate does not vary."""
    steps = median_filter(np.diff(times), _STEPS, mode="nearest")
    changed = np.flatnonzero(np.abs(steps / steps[0] - 1.0) > 0.1)
    if not len(changed):
        return None
    slowest, fastest = 1.0 / steps.max(), 1.0 / steps.min()
    return (
        f"{name}: the rate varies from {slowest:.3g} to {fastest:.3g} images/s, for the first time at "
        f"{times[changed[0]] - times[0]:.2f} s; {1.0 / period:.3g} images/s are used"
    )
