"""Which image belongs to which tick of a regular clock: the vision works in cycles, cameras nearly do."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.errors import DrakeTrackerError

LEAST_FRAMES = 8
"""Fewer images show no motion worth tracking."""


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

    Steps are counted in multiples of the median step, and a line is laid through the times over the counts, so that
    neither a dropped image nor times that a container has rounded to a millisecond put it off. ``name`` is for the
    error: raises DrakeTrackerError when there are fewer than `LEAST_FRAMES` images.
    """
    times = np.asarray(times, dtype=float)
    if len(times) < LEAST_FRAMES:
        raise DrakeTrackerError(f"{name}: there are {len(times)} images; at least {LEAST_FRAMES} are needed")
    steps = np.diff(times)
    counts = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / np.median(steps)), 1.0))])
    middle = counts.mean()
    period = (counts - middle) @ (times - times.mean()) / ((counts - middle) @ (counts - middle))
    return FrameClock(float(period), float(times.mean() - middle * period))
