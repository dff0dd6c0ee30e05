"""Assigns images to the ticks of a regular clock: vision works in cycles, and cameras almost do."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.errors import DrakeTrackerError

LEAST_FRAMES = 8
"""Least number of images that can be tracked."""
MOST_TICKS = 100
"""Largest number of ticks per image: with more, the images are not one recording."""
_GIVE_WAY = 0.1
"""Fraction of a time's error by which the counting clock is corrected."""
_PASSES = 3
"""Number of fits: the jitter of the first image is known only after the first one."""


@dataclass(frozen=True)
class FrameClock:
    """A regular clock for the images of some footage.

    Attributes:
        period: from tick to tick [s].
        start: time of the first tick [s], in the footage's times.
    """

    period: float
    start: float = 0.0

    def tick(self, time: float, previous: int = -1) -> int | None:
        """Returns the tick of an image, or None when no tick is free for it.

        An image that is so early that its tick is taken gets the next one; if that is more than one tick away from the
        nearest, the image is dropped.

        Args:
            time: of the image [s].
            previous: tick of the image before.
        """
        nearest = int(np.floor((time - self.start) / self.period + 0.5))
        tick = max(nearest, previous + 1)
        return tick if tick - nearest <= 1 else None

    def time(self, tick: int) -> float:
        """Returns the time [s] of a tick."""
        return self.start + tick * self.period


def fit_clock(image_times: ArrayLike, name: str = "") -> FrameClock:
    """Returns the `FrameClock` that image times follow, up to dropped images and jitter.

    Ticks are counted by a clock of the median step that is slowly corrected by the times, and a line is fitted to the
    times over the counts: the result is robust to dropped images, jitter, and times that a container has rounded to a
    millisecond.

    Args:
        image_times: shape (n,) [s].
        name: of the footage, for messages.

    Raises DrakeTrackerError when there are fewer than `LEAST_FRAMES` images, or gaps much longer than a period.
    """
    times = np.asarray(image_times, dtype=float)
    if len(times) < LEAST_FRAMES:
        raise DrakeTrackerError(f"{name}: there are {len(times)} images; at least {LEAST_FRAMES} are needed")
    clock = FrameClock(float(np.median(np.diff(times))), float(times[0]))
    for _ in range(_PASSES):
        counts = _count_ticks(times.tolist(), clock)
        if counts[-1] > MOST_TICKS * len(times):
            gap = int(np.argmax(np.diff(times)))
            raise DrakeTrackerError(
                f"{name}: {len(times)} images over {times[-1] - times[0]:.0f} s, with a gap of "
                f"{np.diff(times)[gap]:.0f} s after image {gap + 1}; do all of them belong to this recording?"
            )
        middle = counts.mean()
        period = (counts - middle) @ (times - times.mean()) / ((counts - middle) @ (counts - middle))
        clock = FrameClock(float(period), float(times.mean() - middle * period))
    before = clock.tick(times[0], -(10**9)) or 0  # not 0 where a variable rate leads the times away from the line
    return FrameClock(clock.period, clock.time(before))


def _count_ticks(times: Sequence[float], clock: FrameClock) -> np.ndarray:
    """Returns the number (n,) of the tick nearest to each of the times [s], counted from the first."""
    now, counts = clock.start, [0]
    now += _GIVE_WAY * (times[0] - now)
    for time in times[1:]:
        steps = max(1, round((time - now) / clock.period))
        now += steps * clock.period
        now += _GIVE_WAY * (time - now)
        counts.append(counts[-1] + steps)
    return np.array(counts, dtype=float)
