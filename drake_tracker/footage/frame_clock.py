"""Which image belongs to which tick of a regular clock: the vision works in cycles, cameras nearly do."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

LEAST_FRAMES = 8
"""Fewer images show no motion worth tracking."""
MOST_TICKS = 100
"""Ticks for each image, at most: of more the images are not one recording."""
_GIVE_WAY = 0.1
"""Part of what a time is off by which the counting clock is set."""
_PASSES = 3


@dataclass(frozen=True)
class FrameClock:
    """Ticks of ``period`` [s], the first at ``start`` [s], a time of the footage whose images they count."""

    period: float
    start: float = 0.0

    def tick(self, time, previous=-1):
        """Returns the tick of an image taken at ``time`` [s], or None when there is none left for it.

        ``previous`` is that of the image before. An image that comes so early that its tick is taken goes to the next
        one; if that is not nearest either, it is left out.
        """
        nearest = int(np.floor((time - self.start) / self.period + 0.5))
        tick = max(nearest, previous + 1)
        return tick if tick - nearest <= 1 else None

    def time(self, tick):
        """Returns the time [s] of a tick."""
        return self.start + tick * self.period


def fit_clock(times, name=""):
    """Returns the `FrameClock` to which image times (n,) [s] keep, up to dropped images and jitter.

    Ticks are counted by a clock of the median step that slowly gives way to the times, and a line is laid through the
    times over the counts: neither a dropped image, nor jitter, nor times that a container has rounded to a millisecond
    put it off. ``name`` is for the error: raises DrakeTrackerError when there are fewer than `LEAST_FRAMES` images.
    """
    times = np.asarray(times, dtype=float)
    if len(times) < LEAST_FRAMES:
        raise DrakeTrackerError(f"{name}: there are {len(times)} images; at least {LEAST_FRAMES} are needed")
    clock = FrameClock(float(np.median(np.diff(times))), float(times[0]))
    for _ in range(_PASSES):  # the first image's own jitter is known after the first
        counts = _count_ticks(times.tolist(), clock)
        if counts[-1] > MOST_TICKS * len(times):
            gap = int(np.argmax(np.diff(times)))
            raise DrakeTrackerError(
                f"{name}: {len(times)} images over {times[-1] - times[0]:.0f} s, {np.diff(times)[gap]:.0f} s of them "
                f"between image {gap + 1} and the next; does each belong to this recording?"
            )
        middle = counts.mean()
        period = (counts - middle) @ (times - times.mean()) / ((counts - middle) @ (counts - middle))
        clock = FrameClock(float(period), float(times.mean() - middle * period))
    return clock


def _count_ticks(times, clock):
    """Returns the number (n,) of the tick nearest to each of the times [s], counted from the first."""
    now, counts = clock.start, [0]
    now += _GIVE_WAY * (times[0] - now)
    for time in times[1:]:
        steps = max(1, round((time - now) / clock.period))
        now += steps * clock.period
        now += _GIVE_WAY * (time - now)
        counts.append(counts[-1] + steps)
    return np.array(counts, dtype=float)
