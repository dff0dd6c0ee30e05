"""A camera that is plugged in, as footage."""

import time

import cv2

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.image_files import quiet_opencv

DEFAULT_RATE = 30.0
"""Images per second of a camera that does not say."""


def open_camera(number, fps=None, *, device=cv2.VideoCapture, clock=time.monotonic):
    """Returns the `Footage` of the camera with a number, as OpenCV counts them; it goes on until it is closed.

    An image's time is the instant at which the driver hands it over. While the computer is busy the driver drops
    images, which shows as a gap in these times.

    Args:
        fps: images per second to ask the camera for. device, clock: replaced in tests.

    Raises DrakeTrackerError when there is no such camera, or when it stops.
    """
    with quiet_opencv():
        camera = device(int(number))
        if not camera.isOpened():
            camera.release()
            raise DrakeTrackerError(f"camera {number}: there is no such camera, or another program uses it")
        camera.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # an image that waits would be stamped late
        if fps is not None:
            camera.set(cv2.CAP_PROP_FPS, fps)
        good, image = camera.read()
    if not good:
        camera.release()
        raise DrakeTrackerError(f"camera {number}: it gives no images")
    told = camera.get(cv2.CAP_PROP_FPS)
    rate = fps or (told if 1.0 <= told <= 1000.0 else DEFAULT_RATE)
    height, width = image.shape[:2]
    epoch = clock()

    def frames():
        yield 0.0, cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
        while camera.grab():
            taken = clock() - epoch
            good, newest = camera.retrieve()
            if good:
                yield taken, cv2.cvtColor(newest, cv2.COLOR_BGR2RGB)
        raise DrakeTrackerError(f"camera {number}: it gives no more images")

    return Footage(f"camera {number}", (width, height), frames, epoch=epoch, rate=rate, close=camera.release)
