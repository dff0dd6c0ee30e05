"""Time and error of the ball's detectors beside OpenCV's: a white ball that rolls over a white board with pegs.

    python benchmarks/ball_detectors.py [--frames N] [--flicker F] [--json FILE]

All methods see the same synthetic sequence and are timed from the grey image to the centroid, smoothing included, on
one thread, in turns. Printed are the median time, the error of the centroid (rms of u and v) against the middle of the
ball's image at the centroid's stamp, the share of images with a centroid, and the time in those of the frame
difference with the default settings. The methods whose stamp is the image itself (subtraction of a background) need
that the ball keeps moving, or they learn it.
"""

import argparse
import json

import cv2
import numpy as np
from centroid_speed import SIZE, DenseFlowMethod, compare

from drake_tracker.vision.background_difference import BackgroundDifference
from drake_tracker.vision.frame_difference import FrameDifference, FrameDifferenceParameters
from drake_tracker.vision.normal_flow import NormalFlow
from drake_tracker.vision.normal_flow_parameters import NormalFlowParameters
from drake_tracker.vision.region_centroid import hull_centroid

RADIUS = 3.8
"""Of the ball's image [px]."""
CYCLE = 1 / 60
"""[s]"""
PAUSE = 8
"""Images without a ball between one ball and the next."""
LIGHT = np.array([-0.3, -0.4, 0.87])
"""Towards the light, in (u, v, towards the camera)."""
SAMPLES = 5
"""Rows and columns of samples in a pixel."""


def draw_ball(image, centre):
    """Draws a shaded ball into a float image."""
    u0, v0 = (int(value - RADIUS - 2) for value in centre)
    side = int(2 * RADIUS + 6)
    y, x = (np.mgrid[: side * SAMPLES, : side * SAMPLES] + 0.5) / SAMPLES - 0.5
    x, y = (x + u0 - centre[0]) / RADIUS, (y + v0 - centre[1]) / RADIUS
    z = np.sqrt(np.clip(1.0 - x * x - y * y, 0.0, None))
    brightness = 240.0 * (0.45 + 0.55 * np.clip(np.tensordot(LIGHT, [x, y, z], 1), 0.0, None))
    patch = image[v0 : v0 + side, u0 : u0 + side]
    seen = np.where(z > 0.0, brightness, patch.repeat(SAMPLES, 0).repeat(SAMPLES, 1))
    patch[:] = seen.reshape(side, SAMPLES, side, SAMPLES).mean(axis=(1, 3))


def sequence(count, flicker=0.0, seed=0):
    """Yields (grey uint8 image, true (u, v)): balls released one after another at the top of a board.

    Between two balls the board is empty for a while; then, and `PAUSE` images before and after, the place is NaN and
    counts for nothing. ``flicker`` is the amplitude of the light's change from image to image, as a share of its
    strength.
    """
    rng = np.random.default_rng(seed)
    board = np.full((SIZE, SIZE), 70.0)
    board[20:236, 40:216] = 205.0
    for u, v in rng.uniform([60, 50], [196, 200], (13, 2)).astype(int):
        cv2.circle(board, (int(u), int(v)), 1, 110.0, -1)
    places = []
    while len(places) < count:
        u, v, speed_u, speed_v = rng.uniform(70, 186), 32.0, 0.0, 0.0
        path = []
        while v < 226.0:
            path.append((u, v))
            if rng.random() < 0.03:  # a peg
                speed_u, speed_v = rng.uniform(-2.0, 2.0), speed_v * rng.uniform(0.2, 0.7)
            if not 50.0 < u + speed_u < 206.0:
                speed_u = -speed_u
            speed_v += 1.02 * 180.0 * CYCLE**2  # 3/5 g sin(10 deg), 180 px/m
            u, v = u + speed_u, v + speed_v
        counts = np.arange(len(path))
        counts = (counts >= PAUSE) & (counts < len(path) - PAUSE)
        places += list(zip(path, counts)) + [(None, False)] * PAUSE
    for place, counted in places[:count]:
        image = board.copy()
        if place is not None:
            draw_ball(image, place)
        gain = 1.0 + flicker * rng.uniform(-1.0, 1.0)
        image = gain * image + rng.normal(scale=2.0, size=image.shape)
        yield np.clip(np.rint(image), 0, 255).astype(np.uint8), np.array(place if counted else (np.nan, np.nan))


class DetectorMethod:
    """The whole path of a detector of the package: smoothing, buffered images, mask, centroid."""

    def __init__(self, detector):
        self._detector, self._buffer = detector, ()
        self.delay = detector.stamp_age_cycles

    def __call__(self, grey):
        length = self._detector.buffer_length
        self._buffer = (self._buffer + (self._detector.smooth(grey),))[-length:]
        if len(self._buffer) < length:
            return None
        return self._detector.centroid(self._detector.mask(*self._buffer[:: self._detector.stride]))


class SubtractorMethod:
    """A background subtractor of OpenCV's: the hull of the largest foreground region, as for the ball's detectors."""

    delay = 0

    def __init__(self, model):
        self._model = model

    def __call__(self, grey):
        return hull_centroid(self._model.apply(grey), FrameDifferenceParameters().join_distance)


class DenseFlowHull(DenseFlowMethod):
    """DIS optical flow, ultrafast preset: the hull of the largest region that flows."""

    def __call__(self, grey):
        last, self._last = self._last, grey
        if last is None:
            return None
        flow = self._dis.calc(last, grey, None)
        moving = cv2.compare(cv2.magnitude(flow[..., 0], flow[..., 1]), 0.45, cv2.CMP_GT)
        return hull_centroid(moving, FrameDifferenceParameters().join_distance)


DEFAULT = "frame difference (default)"


def make_methods(static):
    """Returns {name: constructor}; ``static`` is an image of the board without the ball."""

    def difference(**settings):
        return lambda: DetectorMethod(FrameDifference(FrameDifferenceParameters(**settings)))

    return {
        DEFAULT: difference(),
        "frame difference, paper's mean": difference(centroid="mean", threshold=6.0),
        "frame difference, stride 1": difference(stride=1),
        "frame difference, gain normalised": difference(normalise_gain=True),
        "background difference": lambda: DetectorMethod(BackgroundDifference(static)),
        "normal flow": lambda: DetectorMethod(NormalFlow(NormalFlowParameters.preset("scaled"))),
        "DIS optical flow, ultrafast": DenseFlowHull,
        "MOG2": lambda: SubtractorMethod(cv2.createBackgroundSubtractorMOG2(detectShadows=False)),
        "KNN": lambda: SubtractorMethod(cv2.createBackgroundSubtractorKNN(detectShadows=False)),
    }


def measure(frames, flicker=0.0):
    """Returns what `centroid_speed.compare` does over a sequence of ``frames`` images."""
    images, centres = zip(*sequence(frames, flicker))
    static = np.median(images[:: max(1, frames // 40)], axis=0).astype(np.uint8)
    return compare(images, centres, make_methods(static), DEFAULT)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=800, help="images in the sequence (default 800)")
    parser.add_argument("--flicker", type=float, default=0.0, help="change of the light between images (default 0)")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    results = measure(args.frames, args.flicker)
    print(f"one centroid of a {SIZE}x{SIZE} image, one thread, median of {args.frames - args.frames // 4}")
    print(f"{'method':<36}{'time [us]':>11}{'error rms [px]':>16}{'found':>8}{'x default':>12}")
    for name, row in results.items():
        print(f"{name:<36}{row['median_us']:>11.0f}{row['rms_px']:>16.2f}", end="")
        print(f"{row['found']:>8.0%}{row['times_default']:>12.1f}")
    if args.json:
        with open(args.json, "w", encoding="utf-8") as file:
            json.dump({"opencv": cv2.__version__, "frames": args.frames, "methods": results}, file, indent=2)


if __name__ == "__main__":
    main()
