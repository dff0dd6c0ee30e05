"""The newest frame of the cameras for the page of the live view."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import cv2
import numpy as np

from drake_tracker.live.pace import FRAME_INTERVAL

_UNWATCHED_INTERVAL = 1.0
"""Wall time [s] between two frames while no page is open."""
_JPEG_QUALITY = 82


class Frames:
    """The newest frame of the cameras: a `FrameSink` beside the video file. `jpeg` may be called from any thread.

    Attributes:
        number: number of frames taken so far.
    """

    def __init__(
        self,
        watched: Callable[[], bool],
        changed: Callable[[], object],
        opened: Callable[..., object],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Creates a sink without a frame.

        Args:
            watched: returns whether a page is open.
            changed: called when there is a new frame.
            opened: called with keywords ``panels``, a list of {"side", "late", "place"} where ``place`` is (x, y,
                width, height) [px] in the image that `jpeg` returns; ``lag``, the age [s] of the late panels; and
                ``goal``, the name of the marked goal or None.
            clock: returns the wall time [s].
        """
        self._watched, self._changed, self._opened, self._clock = watched, changed, opened, clock
        self._lock = threading.Lock()
        self._page: Any = None
        self._crop: tuple[slice, slice] = np.s_[:, :]
        self._shown: tuple[Mapping[str, Any], Any] | None = None
        self._coded: tuple[Any, bytes] = (None, b"")
        self._due = -np.inf
        self.number = 0

    def open(self, page: Any) -> None:
        """Takes the `VideoPage` with which to draw; its panels are shown, its text is not."""
        self._page = page
        x0, y0 = np.min([place[:2] for _, _, place in page.panels], axis=0)
        x1, y1 = np.max([np.add(place[:2], place[2:]) for _, _, place in page.panels], axis=0)
        self._crop = np.s_[y0:y1, x0:x1]
        panels = [
            {"side": side, "late": late, "place": [int(x - x0), int(y - y0), width, height]}
            for side, late, (x, y, width, height) in page.panels
        ]
        self._opened(panels=panels, lag=page.lag, goal=page.goal)

    @property
    def wanted(self) -> bool:
        """Whether the next frame is due."""
        return self._clock() >= self._due

    def write(self, sights: Mapping[str, Any], state: Any) -> None:
        """Takes what a frame shows, see `VideoPage.draw`. A frame that is not wanted is dropped."""
        if not self.wanted:
            return
        self._due = self._clock() + (FRAME_INTERVAL if self._watched() else _UNWATCHED_INTERVAL)
        self._shown = (sights, state)
        self.number += 1
        self._changed()

    def jpeg(self) -> bytes | None:
        """Returns the newest frame as a JPEG file, None while there is none. It is drawn at the first request."""
        with self._lock:
            shown, (last, coded) = self._shown, self._coded
            if shown is None:
                return None
            if shown is not last:
                options = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
                coded = cv2.imencode(".jpg", self._page.draw(*shown)[self._crop], options)[1].tobytes()
                self._coded = (shown, coded)
            return coded

    def close(self) -> None:
        """Does nothing: the last frame stays."""
