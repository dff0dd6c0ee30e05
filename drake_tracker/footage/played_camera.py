"""A recording that is played as if it were a connected camera: to rehearse a live session, and to test one."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.frame_clock import fit_clock
from drake_tracker.footage.live_camera import open_camera

PREFIX = "play:"
"""What precedes the name of a recording that is to be played."""
_EXACT = 1e-9
"""Time by which an image may be early because sums of times are rounded [s]."""
_PROMPT = 0.002
"""Time by which the first image may be late [s]."""


class Start:
    """The instant at which recordings that are played together begin, so that they show the same moment.

    Attributes:
        time: on the clock of the recordings [s]; None until the first of them is opened.
    """

    def __init__(self) -> None:
        self.time: float | None = None


class PlayedCamera:
    """A recording behind the interface of OpenCV's ``VideoCapture``.

    It plays at its own pace from the first image that is read. Like a camera whose driver keeps one image, it drops
    images while nobody reads them.

    Args:
        footage: recording to play.
        start: shared with the other recordings of the same moment.
        clock: returns the time [s].
        sleep: waits for a time [s].
        most: number of images after which it acts as if it were unplugged; None plays all of them.

    Attributes:
        ended: whether all images were played.
    """

    def __init__(
        self,
        footage: Footage,
        start: Start,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
        most: int | None = None,
    ) -> None:
        self._clock, self._sleep, self._most = clock, sleep, most
        self._images = footage.frames()
        self._rate = 1.0 / fit_clock([] if footage.times is None else footage.times, footage.name).period
        self._start = start
        self._next = next(self._images, None)
        self._newest: np.ndarray | None = None
        self._played = 0
        self.ended = False

    def isOpened(self) -> bool:
        """Returns whether there is an image."""
        return self._next is not None

    def set(self, what: int, value: float) -> bool:
        """Ignores a setting."""
        return False

    def get(self, what: int) -> float:
        """Returns the number of images per second, 0 for any other property."""
        return self._rate if what == cv2.CAP_PROP_FPS else 0.0

    def grab(self) -> bool:
        """Waits for the next image; returns False when there is none."""
        if self._start.time is None:
            self._start.time = self._clock()
        if not self._played:
            self._skip(self._clock() - self._start.time, -_PROMPT)
        if self._next is None or (self._most is not None and self._played >= self._most):
            self.ended = self._next is None
            return False
        wait = self._start.time + self._next[0] - self._clock()
        if wait > 0.0:
            self._sleep(wait)
        self._skip(self._clock() - self._start.time, _EXACT)
        return True

    def _skip(self, now: float, after: float) -> None:
        """Goes on to the first image that is due at least ``after`` later than a time ``now`` of the recording [s]."""
        while self._next is not None and self._next[0] < now + after:
            self._newest, self._next = self._next[1], next(self._images, None)
            self._played += 1

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        """Returns (True, the image that was grabbed, BGR)."""
        return self._newest is not None, None if self._newest is None else cv2.cvtColor(self._newest, cv2.COLOR_RGB2BGR)

    def read(self) -> tuple[bool, np.ndarray | None]:
        """Grabs and retrieves an image."""
        return self.retrieve() if self.grab() else (False, None)

    def release(self) -> None:
        """Plays no more images."""
        self._next = None
        if hasattr(self._images, "close"):
            self._images.close()


def open_played(footage: Footage, name: str, start: Start | None = None, **options: Any) -> Footage:
    """Returns live `Footage` that plays a recording once, and then ends.

    Args:
        footage: recording to play.
        name: of the source.
        start: shared with the other recordings of the same moment; None when there is none.
        options: further arguments of `PlayedCamera`.
    """
    camera = PlayedCamera(footage, start or Start(), **options)
    live = open_camera(0, device=lambda _: camera, clock=options.get("clock", time.monotonic))

    def frames() -> Iterator[tuple[float, np.ndarray]]:
        try:
            yield from live.frames()
        except DrakeTrackerError:
            if not camera.ended:
                raise DrakeTrackerError(f"{name}: it delivers no more images") from None

    def close() -> None:
        live.close()
        footage.close()

    return replace(live, name=name, frames=frames, close=close)
