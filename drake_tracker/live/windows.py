"""Windows around the circles of the board, marked by a person on the page (Nashman and Chaconas 1990, section 3)."""

import math
import threading
from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np

from drake_tracker.cameras.boards.circle_finder import best_measurement, measure_circle
from drake_tracker.core.errors import DrakeTrackerError

LOOK_PERIOD = 0.1
"""Time [s] between two checks whether there is an answer."""
_LARGEST = 4096
_APART = 3.0
"""Centroids [px] closer than this belong to the same circle."""


class WindowQuestion:
    """Asks a person for windows in the images of a scene. Every method but `wait` may be called from any thread.

    Attributes:
        size: (width, height) of the images [px].
        png: the first image as a PNG file.
    """

    def __init__(self, images: Sequence[np.ndarray], threshold: float, count: int) -> None:
        """Creates a question without an answer.

        Args:
            images: RGB uint8, shape (h, w, 3), of the same scene.
            threshold: a pixel at or below this grey value is dark.
            count: number of windows.
        """
        self._grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in images]
        self._threshold, self._count = threshold, count
        self._answer: list[list[float]] = []
        self._answered = threading.Event()
        self.size = (images[0].shape[1], images[0].shape[0])
        self.png: bytes = cv2.imencode(".png", cv2.cvtColor(np.asarray(images[0]), cv2.COLOR_RGB2BGR))[1].tobytes()

    def read(self, window: Any) -> tuple[Any, list[int]]:
        """Measures the circle in a window.

        Args:
            window: (u0, v0, width, height) [px], unchecked.

        Returns (`CircleMeasurement`, the window in whole pixels).

        Raises:
            ValueError: it is not a window, or does not hold exactly one circle.
        """
        if not isinstance(window, list) or len(window) != 4 or not all(_is_pixel(value) for value in window):
            raise ValueError(f"a window is four numbers from 0 to {_LARGEST}")
        window = [int(value) for value in window]
        try:
            return best_measurement([measure_circle(image, window, self._threshold) for image in self._grey]), window
        except DrakeTrackerError as error:
            raise ValueError(str(error)) from None

    def answer(self, windows: Any) -> None:
        """Takes the windows, or an empty list to have the circles found automatically; wakes `wait`.

        Args:
            windows: list of windows as in `read`, unchecked. Raises ValueError when their number is wrong, when one of
                them is invalid, or when two hold the same circle.
        """
        if not isinstance(windows, list) or len(windows) not in (0, self._count):
            raise ValueError(f"{self._count} windows are needed, or none")
        readings = [self.read(window) for window in windows]
        for k, (first, _) in enumerate(readings):
            for j, (second, _) in enumerate(readings[:k]):
                if math.hypot(first.u - second.u, first.v - second.v) < _APART:
                    raise ValueError(f"windows {j + 1} and {k + 1} hold the same circle")
        self._answer = [[float(value) for value in window] for _, window in readings]
        self._answered.set()

    def wait(self, idle: Callable[[], object] = lambda: None) -> list[list[float]]:
        """Returns the windows (u0, v0, width, height) [px] once they are given.

        Args:
            idle: called repeatedly while waiting.
        """
        while not self._answered.wait(LOOK_PERIOD):
            idle()
        return self._answer


def _is_pixel(value: Any) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value) and 0 <= value <= _LARGEST
