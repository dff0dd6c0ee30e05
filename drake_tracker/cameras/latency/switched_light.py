"""Switches a light of this machine at irregular times, and notes when."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

SHORTEST, LONGEST = 0.12, 0.35
"""Range of the times from one switch to the next [s]."""


class SwitchedLight:
    """A light that a thread switches on and off by writing 1 and 0 to a file: a context manager.

    Such a file is ``/sys/class/leds/NAME/brightness`` of an LED that Linux knows, or the value of a GPIO pin. The light
    is off at the end.

    Args:
        path: file to write to; it must exist.
        clock: returns the time [s].
        seed: of the times.

    Attributes:
        switches: (time [s], 1 for on or 0 for off) of each switch so far. The time is the middle of the writing.

    Raises DrakeTrackerError when the file cannot be written.
    """

    def __init__(self, path: str | Path, clock: Callable[[], float] = time.time, seed: int = 0) -> None:
        self._path, self._clock = Path(path), clock
        self._random = np.random.default_rng(seed)
        self._ended = threading.Event()
        self.switches: list[tuple[float, int]] = []
        self._switch(0)
        self._thread = threading.Thread(target=self._run, name="switched light", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        on = 0
        try:
            while not self._ended.wait(self._random.uniform(SHORTEST, LONGEST)):
                on = 1 - on
                self._switch(on)
            self._switch(0)
        except DrakeTrackerError:  # unplugged: the images will say that it does not change
            return

    def _switch(self, on: int) -> None:
        before = self._clock()
        try:
            with open(self._path, "r+b", buffering=0) as file:
                file.write(b"%d\n" % on)
        except OSError as error:
            raise DrakeTrackerError(f"--light {self._path}: cannot be written: {error.strerror}") from None
        if not self.switches or self.switches[-1][1] != on:
            self.switches.append((0.5 * (before + self._clock()), on))
