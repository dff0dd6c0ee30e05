"""A window around each circle of the board, put there by the person at the page (Nashman and Chaconas 1990, section 3)."""

import math
import threading

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.circle_finder import best_reading, read_window

LOOK = 0.1
"""Time [s] between two looks whether there is an answer."""
_LARGEST = 4096
_APART = 3.0
"""Centroids [px] closer than this are of the same circle."""


class WindowQuestion:
    """Asks for ``count`` windows in the images of a scene; all but `wait` may be called from any thread.

    Args:
      images: RGB uint8 (h, w, 3), of the same scene. threshold: pixels that are no brighter [grey] are dark.
    """

    def __init__(self, images, threshold, count):
        self._grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in images]
        self._threshold, self._count = threshold, count
        self._answer, self._answered = None, threading.Event()
        self.size = (images[0].shape[1], images[0].shape[0])
        self.png = cv2.imencode(".png", cv2.cvtColor(np.asarray(images[0]), cv2.COLOR_RGB2BGR))[1].tobytes()

    def read(self, window):
        """Returns the `CircleReading` in a window (u0, v0, width, height) [px], and the window in whole pixels.

        Raises ValueError when it is no window, or does not hold one circle.
        """
        if not isinstance(window, list) or len(window) != 4 or not all(_is_pixel(value) for value in window):
            raise ValueError(f"a window is four numbers from 0 to {_LARGEST}")
        window = [int(value) for value in window]
        try:
            return best_reading([read_window(image, window, self._threshold) for image in self._grey]), window
        except DrakeTrackerError as error:
            raise ValueError(str(error)) from None

    def answer(self, windows):
        """Takes the windows, or none to have the circles found. Raises ValueError on others than are asked for."""
        if not isinstance(windows, list) or len(windows) not in (0, self._count):
            raise ValueError(f"{self._count} windows are needed, or none")
        readings = [self.read(window) for window in windows]
        for k, (first, _) in enumerate(readings):
            for j, (second, _) in enumerate(readings[:k]):
                if math.hypot(first.u - second.u, first.v - second.v) < _APART:
                    raise ValueError(f"windows {j + 1} and {k + 1} hold the same circle")
        self._answer = [[float(value) for value in window] for _, window in readings]
        self._answered.set()

    def wait(self, idle=lambda: None):
        """Returns the windows once they are given, a list; calls ``idle`` from time to time."""
        while not self._answered.wait(LOOK):
            idle()
        return self._answer


def _is_pixel(value):
    return isinstance(value, (int, float)) and math.isfinite(value) and 0 <= value <= _LARGEST
