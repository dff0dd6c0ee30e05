"""The image of each tick of a clock, read one after the other as they are asked for."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError


@dataclass(frozen=True, eq=False)
class Tick:
    """What there is at one tick: RGB image uint8 (h, w, 3), the newest so far; its own stamp [s], or the tick's where
    nothing was taken; whether an image was taken.
    """

    image: np.ndarray
    stamp: float
    fresh: bool


class FrameSequence:
    """A function of the tick's number, `at`, that holds no more than two images of its footage.

    Ticks are asked for in order. One that has gone by makes it begin anew, which a live camera cannot.

    Args:
        footage: `Footage`. clock: `FrameClock` in the footage's times.
        shift: ticks by which this camera began later than the one whose ticks are counted.
        zero: time of this footage [s] at which stamps are 0.
    """

    def __init__(self, footage, clock, shift=0, zero=None):
        self.footage, self.clock, self.shift = footage, clock, shift
        self._zero = clock.time(-shift) if zero is None else zero
        self._rewind()

    def _rewind(self):
        self._frames = self.footage.frames()
        self._next, self._ended = None, False
        self._number, self._previous = -1, None
        self._image = np.zeros((*self.footage.size[::-1], 3), np.uint8)
        self._current = None

    def at(self, number):
        """Returns the `Tick` with a number, counted from 0. Raises DrakeTrackerError when the footage is damaged."""
        if number < self._number:
            if self.footage.live:
                raise DrakeTrackerError(f"{self.footage.name}: a live camera cannot be rewound")
            self._rewind()
        while self._number < number:
            self._step()
        return self._current

    def _step(self):
        self._number += 1
        wanted = self._number - self.shift
        while not self._ended and (self._next is None or self._next[0] < wanted):
            self._next = self._read()
        if self._next is not None and self._next[0] == wanted:
            _, time, self._image = self._next
            self._next = None
            self._current = Tick(self._image, time - self._zero, True)
        else:
            self._current = Tick(self._image, self.clock.time(wanted) - self._zero, False)

    def _read(self):
        """Returns (tick, time [s], image) of the next image that has a tick, or None when there is none."""
        for time, image in self._frames:
            tick = self.clock.tick(time, -(10**9) if self._previous is None else self._previous)
            if tick is not None:
                self._previous = tick
                return tick, time, image
        self._ended = True
        return None
