"""The present state of a run: written by the simulation's thread, read by the threads of the server."""

import threading
from collections.abc import Sequence
from typing import Any

from drake_tracker.live.frames import Frames

LONGEST_HISTORY = 20_000
"""Samples of the strips kept for a page that is opened late; in a longer run every second one is dropped."""

Seen = tuple[int, int, int, int, int]
"""How much of a `LiveState` a page has received: versions of facts and values, number of the frame, number of times
that the samples were thinned out, number of samples."""


class LiveState:
    """Content of the page. Facts change rarely and are sent as a whole. Of the strips' samples, only new samples are
    sent.

    Attributes:
        frames: the cameras' newest frame.
        watchers: number of open pages.
        left: whether the last open page was closed.
    """

    def __init__(self) -> None:
        """Creates the state of a run that is being prepared."""
        self._news = threading.Condition()
        self._facts: dict[str, Any] = {"stage": "preparing"}
        self._facts_version = 0
        self._values: dict[str, Any] = {}
        self._values_version = 0
        self._samples: list[Sequence[Any]] = []
        self._thinned, self._every, self._count = 0, 1, 0
        self._closed = False
        self.watchers = 0
        self.left = False
        self.frames = Frames(lambda: self.watchers > 0, self._wake, self.set_facts)

    def set_facts(self, **facts: Any) -> None:
        """Sets values that change rarely, for JSON."""
        with self._news:
            self._facts = {**self._facts, **facts}
            self._facts_version += 1
            self._news.notify_all()

    def set_values(self, **values: Any) -> None:
        """Replaces the values that change all the time, for JSON."""
        with self._news:
            self._values = values
            self._values_version += 1
            self._news.notify_all()

    def add_sample(self, sample: Sequence[Any]) -> None:
        """Appends a sample of the strips: (time [s], number of the phase, values..., None where unknown)."""
        with self._news:
            self._count += 1
            if self._count % self._every:
                return
            self._samples.append(sample)
            if len(self._samples) > LONGEST_HISTORY:
                self._samples = self._samples[::2]
                self._every *= 2
                self._thinned += 1
            self._news.notify_all()

    def close(self) -> None:
        """Ends every series of `news`: the next return value is the last one."""
        with self._news:
            self._closed = True
            self._news.notify_all()

    def watch(self, joins: bool) -> None:
        """Counts a page that was opened (``joins``) or closed."""
        with self._news:
            self.watchers += 1 if joins else -1
            self.left = not joins and self.watchers == 0

    def news(self, seen: Seen | None, timeout: float) -> tuple[dict[str, Any] | None, Seen, bool]:
        """Waits for something new.

        Args:
            seen: what the page has received, as returned by the previous call; None at first.
            timeout: longest time to wait [s].

        Returns (what is new, a dict for JSON, or None; the next ``seen``; whether more may follow).
        """
        facts, version, frame, thinned, samples = seen or (-1, -1, -1, -1, 0)
        with self._news:
            self._news.wait_for(lambda: self._closed or (facts, version, frame) != self._versions(), timeout)
            news: dict[str, Any] = {}
            if facts != self._facts_version:
                news["facts"] = self._facts
            if version != self._values_version:
                news.update(self._values)
            number = self.frames.number
            if frame != number:
                news["frame"] = number
            if thinned != self._thinned:
                samples, news["afresh"] = 0, True
            if samples < len(self._samples):
                news["samples"] = self._samples[samples:]
            seen = (
                self._facts_version,
                self._values_version,
                news.get("frame", frame),
                self._thinned,
                len(self._samples),
            )
            return news or None, seen, not self._closed

    def _versions(self) -> tuple[int, int, int]:
        return self._facts_version, self._values_version, self.frames.number

    def _wake(self) -> None:
        with self._news:
            self._news.notify_all()
