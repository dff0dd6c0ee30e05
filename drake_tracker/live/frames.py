"""The newest frame of the cameras for the page of the live view."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import cv2
import numpy as np

from drake_tracker.live.pace import FRAME_INTERVAL
from drake_tracker.tasks.style import track_light
from drake_tracker.tasks.tracks import STATE_WORDS

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
                width, height) [px] in the image that `jpeg` returns; ``lag``, the age [s] of the late panels;
                ``goal``, the name of the marked goal or None; ``several``, whether vision tracks several objects; and
                ``legend`` and ``caption``, texts of the page's own (see `open`), or None.
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
        """Takes the `VideoPage` with which to draw; its panels are shown, its text is not.

        A page of another kind has the same attributes, and may have a ``legend``, a list of (kind of a mark, words),
        and a ``caption`` for each panel.
        """
        self._page = page
        x0, y0 = np.min([place[:2] for _, _, place in page.panels], axis=0)
        x1, y1 = np.max([np.add(place[:2], place[2:]) for _, _, place in page.panels], axis=0)
        self._crop = np.s_[y0:y1, x0:x1]
        panels = [
            {"side": side, "late": late, "place": [int(x - x0), int(y - y0), width, height]}
            for side, late, (x, y, width, height) in page.panels
        ]
        words = {name: getattr(page, name, None) for name in ("legend", "caption")}
        self._opened(panels=panels, lag=page.lag, goal=page.goal, several=page.several, **words)

    @property
    def several(self) -> bool:
        """Whether vision tracks several objects."""
        return self._page is not None and self._page.several

    def tracks(self) -> tuple[list[dict[str, Any]], str]:
        """Returns (the tracks in the newest frame, for JSON; why there is no point of the target, or "").

        A track is {"number", "target", "state", "seen", "speed", "size", "colour", "at"}: its state is in words, speed
        and size are in m/s and m, and ``at`` is its position [px] in each panel, None where it has none.
        """
        if self._shown is None:
            return [], ""
        sights, state = self._shown
        places = self._page.places(sights)
        rows = [mark.row for mark in next(iter(sights.values())).tracks]
        return [
            {
                "number": row.number,
                "target": row.target,
                "state": STATE_WORDS[row.state],
                "seen": row.seen,
                "speed": round(float(np.linalg.norm(row.v_WQ)), 3),
                "size": round(row.size, 4),
                "colour": track_light(row.number),
                "at": [
                    [round(x, 1), round(y, 1)] if np.isfinite([x, y]).all() else None for x, y in places[row.number]
                ],
            }
            for row in rows
        ], state.reason

    @property
    def wanted(self) -> bool:
        """Whether the next frame is due."""
        return self._clock() >= self._due

    def write(self, sights: Mapping[str, Any], state: Any) -> None:
        """Accepts the content of a frame, see `VideoPage.draw`. A frame that is not wanted is dropped."""
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
