"""Reads the running code in a photograph of the screen."""

from dataclasses import dataclass

import cv2
import numpy as np

from drake_tracker.cameras.latency.screen_code import FIELDS, MARKERS, RANGE, SIDE, SIZE, dictionary, read_field

_CELL = 8
"""Side of a cell in the rectified image [px]."""
_LEAST_MARKERS = 3
_LEAST_CONTRAST = 12.0
"""Least difference between white and black in a field [grey values]."""
_CORNERS = np.array([[0, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]], dtype=np.float32)


@dataclass(frozen=True)
class Reading:
    """Content of an image.

    Attributes:
        time: newest time in the code [ms], modulo `RANGE`: the field with it was the last to change.
        steps: differences between times that were shown one after the other [ms].
    """

    time: int
    steps: tuple[int, ...]


class CodeReader:
    """Reads the code in the images of one camera."""

    def __init__(self) -> None:
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        settings.minMarkerPerimeterRate = 0.01
        self._detector = cv2.aruco.ArucoDetector(dictionary(), settings)

    def read(self, grey: np.ndarray) -> Reading | None:
        """Returns the `Reading` of a grey image, uint8 (h, w).

        None when fewer than three markers are found, when a field that has just changed cannot be read, or when the
        times do not follow each other: then the image shows no code, or the screen in the middle of a change.
        """
        H = self._rectification(grey)
        if H is None:
            return None
        flat = cv2.warpPerspective(grey, H, (_CELL * SIZE[0], _CELL * SIZE[1]), flags=cv2.INTER_AREA)
        return _newest([_read_field(flat, place) for place in FIELDS])

    def _rectification(self, grey: np.ndarray) -> np.ndarray | None:
        """Returns the homography from the image to the rectified code, None without enough markers."""
        corners, numbers, _ = self._detector.detectMarkers(grey)
        found = {} if numbers is None else {int(n): c.reshape(4, 2) for n, c in zip(numbers.ravel(), corners)}
        known = [number for number in range(len(MARKERS)) if number in found]
        if len(known) < _LEAST_MARKERS:
            return None
        seen = np.concatenate([found[number] for number in known])
        # OpenCV's pixel (0, 0) is the centre of a pixel; the corner of a cell lies between pixels.
        drawn = np.concatenate([_CELL * (_CORNERS + MARKERS[number]) - 0.5 for number in known])
        return cv2.findHomography(seen, drawn)[0]


def read_code(grey: np.ndarray) -> Reading | None:
    """Returns the `Reading` of a single grey image, uint8 (h, w), see `CodeReader.read`."""
    return CodeReader().read(grey)


def _read_field(flat: np.ndarray, place: tuple[int, int]) -> int | None:
    """Returns the time [ms] in a field of the rectified image, or None when it cannot be read."""
    x, y = (_CELL * value for value in place)
    side = _CELL * SIDE
    cells = flat[y : y + side, x : x + side].reshape(SIDE, _CELL, SIDE, _CELL)
    quarter = _CELL // 4
    values = cells[:, quarter:-quarter, :, quarter:-quarter].mean(axis=(1, 3))
    white, black = 0.5 * (values[0, 0] + values[-1, -1]), 0.5 * (values[0, -1] + values[-1, 0])
    if white - black < _LEAST_CONTRAST:
        return None
    return read_field(values > 0.5 * (white + black))


def _newest(times: list[int | None]) -> Reading | None:
    """Returns the newest of the times in the fields, which are changed in turn."""
    known = [(k, time) for k, time in enumerate(times) if time is not None]
    if len(known) < 3:
        return None
    reference = known[0][1]
    place, newest = max(known, key=lambda each: _signed(each[1] - reference))
    count = len(times)
    ages = [None if (t := times[(place - k) % count]) is None else _signed(newest - t) for k in range(count)]
    if ages[-1] is None:  # the field that is next to change is changing
        return None
    following = [age for age in ages if age is not None]
    if any(later <= earlier for earlier, later in zip(following, following[1:])):
        return None
    steps = tuple(b - a for a, b in zip(ages, ages[1:]) if a is not None and b is not None)
    return Reading(newest, steps)


def _signed(difference: int) -> int:
    """Returns a difference of times [ms], which repeat after `RANGE`, with its sign."""
    return (difference + RANGE // 2) % RANGE - RANGE // 2
