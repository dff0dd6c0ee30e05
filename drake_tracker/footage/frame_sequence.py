"""The image of each tick of a clock, read one after the other on demand."""

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.frame_clock import FrameClock
from drake_tracker.footage.read_ahead import read_ahead

_MOST_AHEAD, _AHEAD_BYTES = 8, 64_000_000
"""Largest number of images read ahead, and the memory that they may occupy [bytes]."""


@dataclass(frozen=True, eq=False)
class Tick:
    """What there is at one tick.

    Attributes:
        image: the newest image so far, RGB uint8 (h, w, 3).
        grey: the same as grey values, uint8 (h, w).
        stamp: capture time of the image, or the time of the tick when no image was captured in it [s].
        fresh: whether an image was captured in this tick.
    """

    image: np.ndarray
    grey: np.ndarray
    stamp: float
    fresh: bool


class FrameSequence:
    """The ticks of some footage by number (`at`). Holds two images in memory, and those that a thread reads ahead.

    Ticks are requested in order. A request for an earlier tick reads the footage again from its beginning, which is not
    possible with a live camera.

    Args:
        footage: of one camera.
        clock: in the footage's times.
        shift: number of ticks by which this camera began later than the one whose ticks are counted.
        zero: time of this footage at which stamps are 0 [s]; None is the first counted tick.

    Attributes:
        surplus: number of images so far that no tick was free for.
    """

    def __init__(self, footage: Footage, clock: FrameClock, shift: int = 0, zero: float | None = None) -> None:
        self.footage, self.clock, self.shift = footage, clock, shift
        self._zero = clock.time(-shift) if zero is None else zero
        self._frames: Iterator[tuple[float, np.ndarray, np.ndarray]] = iter(())
        self._rewind()

    @property
    def ended(self) -> bool:
        """Whether the footage has no image after the current tick."""
        return self._ended and self._next is None

    def close(self) -> None:
        """Ends the thread that reads ahead. May be called again; the sequence can still be rewound."""
        if isinstance(self._frames, Generator):
            self._frames.close()

    def _rewind(self) -> None:
        self.close()
        if self.footage.live:  # the stamp of an image is the instant at which it is requested
            self._frames = _with_grey(self.footage)
        else:
            bytes_each = 4 * self.footage.size[0] * self.footage.size[1]
            count = int(np.clip(_AHEAD_BYTES // bytes_each, 1, _MOST_AHEAD))
            self._frames = read_ahead(partial(_with_grey, self.footage), count)
        self._next: tuple[int, float, np.ndarray, np.ndarray] | None = None
        self._ended = False
        self._number = -1
        self._previous: int | None = None
        self.surplus = 0
        self._image = np.zeros((*self.footage.size[::-1], 3), np.uint8)
        self._grey = np.zeros(self.footage.size[::-1], np.uint8)
        self._current: Tick | None = None

    def at(self, number: int) -> Tick:
        """Returns the `Tick` with a number, counted from 0.

        Raises DrakeTrackerError when the footage is damaged, or is live and would have to be rewound.
        """
        if number < self._number:
            if self.footage.live:
                raise DrakeTrackerError(f"{self.footage.name}: a live camera cannot be rewound")
            self._rewind()
        while self._number < number:
            self._current = self._step()
        assert self._current is not None  # number 0 was requested before
        return self._current

    def _step(self) -> Tick:
        self._number += 1
        wanted = self._number - self.shift
        while not self._ended and (self._next is None or self._next[0] < wanted):
            self._next = self._read()
        if self._next is not None and self._next[0] == wanted:
            _, time, self._image, self._grey = self._next
            self._next = None
            return Tick(self._image, self._grey, time - self._zero, True)
        return Tick(self._image, self._grey, self.clock.time(wanted) - self._zero, False)

    def _read(self) -> tuple[int, float, np.ndarray, np.ndarray] | None:
        """Returns (tick, time [s], image, grey image) of the next image that has a tick, or None when there is none."""
        for time, image, grey in self._frames:
            tick = self.clock.tick(time, -(10**9) if self._previous is None else self._previous)
            if tick is not None:
                self._previous = tick
                return tick, time, image, grey
            self.surplus += 1
        self._ended = True
        return None


def _with_grey(footage: Footage) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Yields (time [s], RGB image, grey image) of each image."""
    for time, image in footage.frames():
        yield time, image, cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
