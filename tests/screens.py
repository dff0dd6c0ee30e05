"""Synthetic photographs of a screen that shows the running code, with known times of exposure."""

import cv2
import numpy as np

from drake_tracker.cameras.latency.screen_code import FIELDS, SIZE, draw_code

CELL = 10
REFRESH = 1.0 / 60.0
"""Time from one image of the screen to the next [s]."""


class Screen:
    """A screen that draws its rows from top to bottom, one field at a time, seen by a camera with a rolling shutter.

    Attributes:
        refresh: time from one image of the screen to the next [s].
    """

    def __init__(
        self, size=(320, 240), refresh=REFRESH, scan=0.0, exposure=0.008, rolling=0.0, blur=1.0, noise=3.0, turn=0.0
    ):
        """Times [s]: ``scan`` from the first to the last row of the code on the screen, ``rolling`` of the sensor."""
        self.refresh, self.size, self.exposure, self.blur, self.noise = refresh, size, exposure, blur, noise
        self._states = {}
        width, height = size
        drawn = np.float32([[0, 0], [CELL * SIZE[0], 0], [CELL * SIZE[0], CELL * SIZE[1]], [0, CELL * SIZE[1]]])
        corners = np.float32([[0.10, 0.22], [0.88, 0.17], [0.93, 0.80], [0.07, 0.74]]) * [width, height]
        c, s = np.cos(turn), np.sin(turn)
        middle = np.array([0.5 * width, 0.5 * height])
        corners = np.float32((corners - middle) @ np.array([[c, s], [-s, c]]) + middle)
        self._H = cv2.getPerspectiveTransform(drawn, corners)
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        on_screen = cv2.perspectiveTransform(
            np.stack([columns, rows], -1).reshape(1, -1, 2).astype(np.float64), np.linalg.inv(self._H)
        ).reshape(height, width, 2)
        below = np.clip(on_screen[..., 1] / (CELL * SIZE[1]), 0.0, 1.0) - 0.5
        self._late = rolling * (rows / height - 0.5) - scan * below
        """Mid-exposure of each pixel, less the delay of the screen there [s], after that of the image's middle."""

    def _state(self, k):
        """The image of the screen after its k-th change."""
        if k not in self._states:
            count = len(FIELDS)
            numbers = [k - (k - j) % count for j in range(count)]
            code = draw_code([round(1e3 * number * self.refresh) for number in numbers], CELL)
            self._states[k] = cv2.warpPerspective(
                code, self._H, self.size, flags=cv2.INTER_AREA, borderValue=60
            ).astype(float)
        return self._states[k]

    def photograph(self, time, rng=None):
        """The grey image whose middle row is exposed around a time [s]."""
        start, end = (time + self._late + sign * self.exposure for sign in (-0.5, 0.5))
        image = np.zeros(self.size[::-1])
        for k in range(int(np.floor(start.min() / self.refresh)), int(np.floor(end.max() / self.refresh)) + 1):
            share = np.minimum(end, (k + 1) * self.refresh) - np.maximum(start, k * self.refresh)
            image += np.clip(share, 0.0, None) / self.exposure * self._state(k)
        image = 25.0 + 0.75 * image
        if self.blur:
            image = cv2.GaussianBlur(image, (0, 0), self.blur)
        if rng is not None:
            image += rng.normal(0.0, self.noise, image.shape)
        return np.rint(np.clip(image, 0, 255)).astype(np.uint8)
