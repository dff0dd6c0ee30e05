"""Latency from a light that is switched at known times."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.regular_file import read_text

GRID = (32, 24)
"""Columns and rows of the blocks of an image in which brightness is compared."""
_LEAST_CORRELATION = 0.5
"""Least correlation of the brightness of a block with the light, for an image sequence that shows the light."""
_LONGEST_GAP = 2.5
"""Longest time between the images before and after a switch, in periods of the images."""
_COARSE = 0.005
"""Step of the first search [s]."""
SHORTEST, LONGEST = 0.12, 0.35
"""Range of the times from one switch to the next [s]."""


def block_brightness(grey: np.ndarray) -> np.ndarray:
    """Returns the mean grey value of each block of an image, float32 of shape (768,).

    Args:
        grey: uint8, shape (h, w).
    """
    return cv2.resize(grey, GRID, interpolation=cv2.INTER_AREA).astype(np.float32).ravel()


def switch_bounds(
    stamps: np.ndarray, blocks: np.ndarray, switches: np.ndarray, states: np.ndarray, search: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (lowest, highest): the latency [s] that each switch of the light allows, shape (m,) each.

    The latency with the greatest correlation of brightness and light decides which images show which switch. The last
    image before and the first image after it, by their brightness, then bound the latency.

    Args:
        stamps: of the images [s], shape (n,).
        blocks: brightness of each image's blocks, see `block_brightness`, shape (n, 768).
        switches: times at which the light was switched [s], increasing, shape (m,).
        states: 1 where it was switched on, 0 where off, shape (m,).
        search: least and greatest latency [s].

    Raises DrakeTrackerError when the brightness of no block follows the light.
    """
    lags = np.arange(search[0], search[1] + _COARSE, _COARSE)
    place = np.searchsorted(switches, stamps[None] - lags[:, None], "right") - 1  # (lags, n)
    light = np.where(place >= 0, states[np.maximum(place, 0)], 1.0 - states[0])
    inside = (place >= 0) & (place < len(switches) - 1)  # images taken while the light was being switched
    best, lag, weights = 0.0, 0.0, np.zeros(blocks.shape[1])
    for k in np.flatnonzero(inside.sum(axis=1) >= 0.5 * inside.sum(axis=1).max()):
        correlation = _correlation(light[k, inside[k]], blocks[inside[k]])
        if np.abs(correlation).max() > best:
            best, lag = float(np.abs(correlation).max()), float(lags[k])
            weights = np.where(np.abs(correlation) > 0.8 * best, correlation, 0.0)
    if best < _LEAST_CORRELATION:
        raise DrakeTrackerError(
            f"no part of the images follows the light (correlation {best:.2f}, at least {_LEAST_CORRELATION:g} is "
            "needed); the light must be in view and its surroundings dark"
        )
    bright = blocks @ weights
    low, high = np.percentile(bright, [10, 90])
    on = bright > 0.5 * (low + high)
    period = float(np.median(np.diff(stamps)))
    bounds = []
    for switched, state in zip(switches, states):
        near = np.flatnonzero(np.abs(stamps - lag - switched) < 2 * period)
        changed = [i for i in near if i > 0 and on[i] != on[i - 1] and on[i] == bool(state)]
        if len(changed) == 1 and stamps[changed[0]] - stamps[changed[0] - 1] < _LONGEST_GAP * period:
            bounds.append((stamps[changed[0] - 1] - switched, stamps[changed[0]] - switched))
    lowest, highest = np.array(bounds).reshape(-1, 2).T
    return lowest, highest


def _correlation(light: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Returns the correlation of a signal (n,) with each column of an array (n, m)."""
    light = light - light.mean()
    blocks = blocks - blocks.mean(axis=0)
    scale = np.sqrt((light @ light) * np.einsum("ij,ij->j", blocks, blocks))
    return np.where(scale > 1e-6, light @ blocks / np.maximum(scale, 1e-6), 0.0)


def write_switches(path: Path, switches: Sequence[tuple[float, int]]) -> None:
    """Writes the times of a light, CSV with the columns time [s since 1970] and on (0 or 1)."""
    from drake_tracker.core.files.atomic_file import write_text

    write_text(path, "time,on\n" + "".join(f"{time:.6f},{on}\n" for time, on in switches))


def read_switches(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Returns (times [s], states 0 or 1) of a file of `write_switches`, shape (m,) each.

    Raises DrakeTrackerError, one line, when it is no such file.
    """
    try:
        lines = read_text(path).split()
        rows = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it does not have the columns time,on"
        raise DrakeTrackerError(f"{path}: the times of the light cannot be read: {reason}") from None
    if rows.ndim != 2 or rows.shape[1] != 2 or len(rows) < 2 or not np.isfinite(rows).all():
        raise DrakeTrackerError(f"{path}: the times of the light need the columns time,on and two rows or more")
    if (np.diff(rows[:, 0]) <= 0.0).any() or not np.isin(rows[:, 1], (0.0, 1.0)).all():
        raise DrakeTrackerError(f"{path}: the times of the light must increase, and on must be 0 or 1")
    return rows[:, 0], rows[:, 1]


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
