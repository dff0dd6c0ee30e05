"""The newest of a run: the simulation's thread writes it, the server's threads read it."""

import threading
import time

import cv2
import numpy as np

LONGEST_HISTORY = 20_000
"""Samples of the strips that are kept for a page that is opened late; of a longer run, every other one."""
_FRAME_INTERVAL, _UNWATCHED_INTERVAL = 1 / 12, 1.0
"""Wall time [s] between two camera frames, while somebody watches and while nobody does."""
_JPEG_QUALITY = 82


class Frames:
    """The newest frame of the cameras. A sink of `record.video.CameraVideoSystem`; `jpeg` may be called by any thread.

    Args:
      watched: returns whether anybody looks. changed: called when there is a new frame. opened: called with
      ``panels``, a list of {"side", "late", "place"}, ``place`` being (x, y, width, height) [px] in the images that
      `jpeg` returns, and ``lag`` [s] of the late ones.
      clock: returns the wall time [s].
    """

    def __init__(self, watched, changed, opened, clock=time.monotonic):
        self._watched, self._changed, self._opened, self._clock = watched, changed, opened, clock
        self._lock = threading.Lock()
        self._crop = self._frame = self._coded = None
        self._due = -np.inf
        self.number = 0

    def open(self, page):
        """Takes the `VideoPage` whose frames are to come: its panels are shown, its words are not."""
        x0, y0 = np.min([place[:2] for _, _, place in page.panels], axis=0)
        x1, y1 = np.max([np.add(place[:2], place[2:]) for _, _, place in page.panels], axis=0)
        self._crop = np.s_[y0:y1, x0:x1]
        panels = [
            {"side": side, "late": late, "place": [int(x - x0), int(y - y0), width, height]}
            for side, late, (x, y, width, height) in page.panels
        ]
        self._opened(panels=panels, lag=page.lag)

    @property
    def wanted(self):
        """Whether it is time for another frame."""
        return self._clock() >= self._due

    def write(self, image):
        """Takes a BGR frame, which must not change any more. One that is not wanted is dropped."""
        if not self.wanted:
            return
        self._due = self._clock() + (_FRAME_INTERVAL if self._watched() else _UNWATCHED_INTERVAL)
        with self._lock:
            self._frame, self._coded = image, None
            self.number += 1
        self._changed()

    def jpeg(self):
        """Returns the newest frame as a JPEG file, bytes, or None while there is none. It is coded when first asked
        for.
        """
        with self._lock:
            if self._frame is None:
                return None
            if self._coded is None:
                options = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
                self._coded = cv2.imencode(".jpg", self._frame[self._crop], options)[1].tobytes()
            return self._coded

    def close(self):
        """Nothing is to be closed: the last frame stays."""


class LiveState:
    """What the page shows. Facts are set seldom and sent whole; of the strips' samples only new ones are sent.

    ``frames`` is a `Frames`; ``watchers`` counts the pages that are open.
    """

    def __init__(self):
        self._news = threading.Condition()
        self._facts, self._facts_version = {"stage": "preparing"}, 0
        self._now, self._version = {}, 0
        self._samples, self._dropped, self._every, self._count = [], 0, 1, 0
        self._closed = False
        self.watchers = 0
        self.left = False
        self.frames = Frames(lambda: self.watchers > 0, self._wake, self.set_facts)

    def set_facts(self, **facts):
        """Sets what seldom changes: values for JSON."""
        with self._news:
            self._facts = {**self._facts, **facts}
            self._facts_version += 1
            self._news.notify_all()

    def tell(self, **values):
        """Sets what changes all the time: values for JSON."""
        with self._news:
            self._now = values
            self._version += 1
            self._news.notify_all()

    def add_sample(self, sample):
        """Appends a row of the strips: (time [s], phase's number, values, None where not known)."""
        with self._news:
            self._count += 1
            if self._count % self._every:
                return
            self._samples.append(sample)
            if len(self._samples) > LONGEST_HISTORY:
                self._samples = self._samples[::2]
                self._every *= 2
                self._dropped += 1
            self._news.notify_all()

    def close(self):
        """Lets `news` end: what it returns is the last."""
        with self._news:
            self._closed = True
            self._news.notify_all()

    def watch(self, joins):
        """Counts a page that was opened, or one that was closed."""
        with self._news:
            self.watchers += 1 if joins else -1
            self.left = not joins and self.watchers == 0

    def news(self, seen, timeout):
        """Returns (what is new since ``seen``, a dict for JSON, or None when nothing was within ``timeout`` [s]; the
        next ``seen``; whether more may come). ``seen`` is None at first.
        """
        facts, version, frame, dropped, samples = seen or (-1, -1, -1, -1, 0)
        with self._news:
            self._news.wait_for(lambda: self._closed or (facts, version, frame) != self._versions(), timeout)
            news = {}
            if facts != self._facts_version:
                news["facts"] = self._facts
            if version != self._version:
                news.update(self._now)
            number = self.frames.number
            if frame != number:
                news["frame"] = number
            if dropped != self._dropped:
                samples, news["afresh"] = 0, True
            if samples < len(self._samples):
                news["samples"] = self._samples[samples:]
            seen = (self._facts_version, self._version, news.get("frame", frame), self._dropped, len(self._samples))
            return news or None, seen, not self._closed

    def _versions(self):
        return self._facts_version, self._version, self.frames.number

    def _wake(self):
        with self._news:
            self._news.notify_all()
