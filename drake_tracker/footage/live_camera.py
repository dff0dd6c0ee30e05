"""A connected camera as footage."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.decoding import quiet_opencv
from drake_tracker.footage.footage import Footage

DEFAULT_RATE = 30.0
"""Images per second of a camera that does not report its rate."""


def open_camera(
    number: int | str,
    fps: float | None = None,
    *,
    device: Callable[[int], Any] = cv2.VideoCapture,
    clock: Callable[[], float] = time.monotonic,
) -> Footage:
    """Returns the `Footage` of a camera, which continues until it is closed.

    The time of an image is the instant at which the driver delivers it. While the computer is busy the driver drops
    images, which appears as a gap in the times.

    Args:
        number: of the camera, as OpenCV counts them.
        fps: images per second to request from the camera; None leaves it as it is.
        device: function that opens a camera by its number.
        clock: function that returns the time [s]; the epoch of the footage is a time since 1970 by the default one.

    Raises DrakeTrackerError when there is no such camera, or when it stops.
    """
    with quiet_opencv():
        camera = device(int(number))
        if not camera.isOpened():
            camera.release()
            raise DrakeTrackerError(f"camera {number}: there is no such camera, or another program uses it")
        camera.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # an image that waits in a buffer would be stamped late
        if fps is not None:
            camera.set(cv2.CAP_PROP_FPS, fps)
        good, image = camera.read()
    if not good:
        camera.release()
        raise DrakeTrackerError(f"camera {number}: it delivers no images")
    told = camera.get(cv2.CAP_PROP_FPS)
    rate = fps or (told if 1.0 <= told <= 1000.0 else DEFAULT_RATE)
    height, width = image.shape[:2]
    epoch = clock()
    since_1970 = epoch + (time.time() - time.monotonic() if clock is time.monotonic else 0.0)

    def frames() -> Iterator[tuple[float, np.ndarray]]:
        yield 0.0, cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
        while camera.grab():
            taken = clock() - epoch
            good, newest = camera.retrieve()
            if good:
                yield taken, cv2.cvtColor(newest, cv2.COLOR_BGR2RGB)
        raise DrakeTrackerError(f"camera {number}: it delivers no more images")

    return Footage(f"camera {number}", (width, height), frames, epoch=since_1970, rate=rate, close=camera.release)
