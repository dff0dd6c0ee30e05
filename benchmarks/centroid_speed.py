"""Measures the time of one motion centroid, and that of OpenCV's dense optical flow and background subtraction.

    python benchmarks/centroid_speed.py [--frames N] [--json FILE]

All methods see the same synthetic sequence of 256x256 images in the same run. They are timed from the grey image to the
centroid, smoothing included, on one thread, in turns of a few images, so that a busy machine slows all of them. The
table has the median time, the error of the centroid against the body's true centre, and the time over the default's.
"""

import argparse
import math
import time
from collections import deque

import cv2
import numpy as np
from result_tables.speed_tables import methods_table
from shared.common import print_table, save_json

from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.region_centroid import mean_centroid

SIZE = 256
SEED = 0
TURN = 20
"""Images that a method processes before the next method has its turn."""
FLOW_THRESHOLD = 0.45
"""Displacement [px] between consecutive images above which a pixel of the dense flow moves: half the body's own."""


def sequence(count, speed=0.9, seed=SEED):
    """Yields (grey uint8 image, true (u, v)): a textured bright body on a textured dark table, with sensor noise."""
    rng = np.random.default_rng(seed)
    table = 45.0 + 5.0 * cv2.GaussianBlur(rng.normal(size=(SIZE, SIZE)), (0, 0), 2.0) * 7.0
    body = 165.0 + 14.0 * cv2.GaussianBlur(rng.normal(size=(18, 40)), (0, 0), 1.5) * 5.0
    coverage = np.ones_like(body)
    for k in range(count):
        angle = speed * k / 70.0
        centre = np.array([128.0 + 70.0 * np.cos(angle), 128.0 + 45.0 * np.sin(angle)])
        heading = np.arctan2(45.0 * np.cos(angle), -70.0 * np.sin(angle))
        c, s = np.cos(heading), np.sin(heading)
        R = np.array([[c, -s], [s, c]])
        M = np.column_stack([R, centre - R @ [(body.shape[1] - 1) / 2, (body.shape[0] - 1) / 2]])
        alpha = cv2.warpAffine(coverage, M, (SIZE, SIZE), flags=cv2.INTER_LINEAR)
        paint = cv2.warpAffine(body, M, (SIZE, SIZE), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        image = table * (1.0 - alpha) + paint * alpha + rng.normal(scale=2.0, size=table.shape)
        yield np.clip(np.rint(image), 0, 255).astype(np.uint8), centre


class NormalFlowMethod:
    """The complete detector: smoothing, three buffered images, mask and centroid."""

    def __init__(self, **overrides):
        self._flow = NormalFlowDetector(NormalFlow(**overrides))
        self._buffer = deque(maxlen=self._flow.buffer_length)
        self.delay = self._flow.stamp_age_cycles

    def __call__(self, grey):
        self._buffer.append(self._flow.smooth(grey))
        if len(self._buffer) < self._flow.buffer_length:
            return None
        images = tuple(self._buffer)[:: self._flow.stride]
        return self._flow.centroid(self._flow.mask(*images))


class DenseFlowMethod:
    """DIS optical flow, ultrafast preset: the mean of the pixels whose flow exceeds a threshold."""

    delay = 0.5

    def __init__(self):
        self._dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._last = None

    def __call__(self, grey):
        last, self._last = self._last, grey
        if last is None:
            return None
        flow = self._dis.calc(last, grey, None)
        speed = cv2.magnitude(flow[..., 0], flow[..., 1])
        return mean_centroid(cv2.compare(speed, FLOW_THRESHOLD, cv2.CMP_GT))


class BackgroundMethod:
    """MOG2 background subtraction: the mean of the foreground pixels."""

    delay = 0

    def __init__(self):
        self._model = cv2.createBackgroundSubtractorMOG2(detectShadows=False)

    def __call__(self, grey):
        return mean_centroid(self._model.apply(grey))


DEFAULT = "normal flow, hull (default)"
"""The method with the settings of the preset ``scaled``."""
METHODS = {
    DEFAULT: NormalFlowMethod,
    "normal flow, mean": lambda: NormalFlowMethod(centroid="mean"),
    "normal flow, hull, float": lambda: NormalFlowMethod(path="float"),
    "DIS optical flow, ultrafast": DenseFlowMethod,
    "MOG2 background": BackgroundMethod,
}


def compare(images, centres, methods, default):
    """Returns {method: {median_us, rms_px, found, times_default}} of methods that all see the same images.

    The methods take turns of `TURN` images. The first quarter of the sequence does not count: it warms the caches and
    trains the backgrounds. ``found`` is the share of the other images with a centroid.

    Args:
        images: the grey images.
        centres: the object's true (u, v) in each image, NaN where it does not count.
        methods: {name: constructor}.
        default: the name of the method to compare with.
    """
    frames = len(images)
    names, methods = list(methods), {name: make() for name, make in methods.items()}
    seconds = {name: [] for name in names}
    errors = {name: [] for name in names}
    for first in range(0, frames, TURN):
        for name, method in methods.items():
            for k in range(first, min(first + TURN, frames)):
                start = time.perf_counter()
                region = method(images[k])
                elapsed = time.perf_counter() - start
                if k < frames // 4:
                    continue
                seconds[name].append(elapsed)
                described = k - method.delay
                true_centre = (centres[math.floor(described)] + centres[math.ceil(described)]) / 2
                if np.isfinite(true_centre).all():
                    found = (np.nan, np.nan) if region is None else region[:2]
                    errors[name].append(np.array(found) - true_centre)
    medians = {name: float(np.median(values)) for name, values in seconds.items()}
    return {
        name: {
            "median_us": 1e6 * medians[name],
            "rms_px": float(np.sqrt(np.nanmean(np.square(errors[name])))),
            "found": float(np.isfinite(errors[name]).mean()),
            "times_default": medians[name] / medians[default],
        }
        for name in names
    }


def measure(frames):
    """Returns the result of `compare` on a sequence of ``frames`` images."""
    images, centres = zip(*sequence(frames))
    return compare(images, centres, METHODS, DEFAULT)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=600, help="images in the sequence (default 600)")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    results = measure(args.frames)
    print(f"one centroid of a {SIZE}x{SIZE} image, one thread, median of {args.frames - args.frames // 4}")
    print_table(*methods_table(results))
    save_json({"opencv": cv2.__version__, "frames": args.frames, "methods": results}, args.json, [SEED])


if __name__ == "__main__":
    main()
