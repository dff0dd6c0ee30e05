"""Synthetic footage of one camera: a disc without texture that moves to and fro."""

import cv2
import numpy as np

from drake_tracker.footage.footage import Footage

PERIOD = 1.0 / 30.0


def clip(radius, speed, count=110, size=(400, 300)):
    """A disc without texture that moves to the right in front of a textured background."""
    rng = np.random.default_rng(1)
    scene = 110.0 + 15.0 * cv2.resize(rng.normal(size=(size[1] // 8, size[0] // 8)), size)
    rows, columns = np.mgrid[: size[1], : size[0]]
    span = size[0] - 2.0 * radius - 20.0
    for k in range(count):
        u = radius + 10.0 + span - abs((speed * k) % (2.0 * span) - span)
        image = scene + np.clip(radius + 0.5 - np.hypot(columns - u, rows - 150.0), 0.0, 1.0) * (225.0 - scene)
        yield u, np.clip(image + rng.normal(0.0, 2.0, image.shape), 0, 255).astype(np.uint8)


def live(pictures, period=PERIOD):
    """A camera that is read once: the first image may come again, as with OpenCV's."""
    source = iter(list(enumerate(pictures))[1:])

    def frames():
        yield 0.0, np.repeat(pictures[0][..., None], 3, axis=2)
        for k, picture in source:
            yield k * period, np.repeat(picture[..., None], 3, axis=2)

    return Footage("camera 0", pictures[0].shape[::-1], frames, epoch=100.0, rate=1.0 / period)
