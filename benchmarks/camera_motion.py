"""Compares methods that fit the motion of the camera itself: how well, and how fast, is an image aligned?

    python benchmarks/camera_motion.py [--seeds N] [--time] [--json FILE]

The images are those of the left camera in `train:learned`, in the rendered window, with the train moving and
the arm at rest. Sensor noise is added, and the faults of the package (`!CameraShake`, `!CameraPan`, `!CameraKnocked`)
move the camera. Each method gets the scene without the train and the image, and returns a homography; those that start
from a first estimate get the previous one. The error is the root mean square distance over the window between the
pixels moved by the homography found and by the true one. An image has failed when a method finds nothing or is off by
more than 1 px. ``false pixels`` is the share of the pixels away from the train that differ from the scene by more than
`GATE` after the alignment; ``granted`` is the same when edges are granted a residual shift of `GRANTED` px.

``--time`` also measures the time of one image; run nothing else meanwhile.
"""

import argparse
import time

import cv2
import numpy as np
from shared.common import print_table, save_json
from shared.rendered_images import train_sequence

from drake_tracker import load_scenario
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.faults import config
from drake_tracker.faults.camera_faults import turned
from drake_tracker.faults.fault import FaultyView
from drake_tracker.faults.kinds import make_faults
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.vision.camera_motion import CameraMotionDetector, align, edge_tolerance
from drake_tracker.world.imaging.sensor_model import SensorNoise

LAPS, FIRST, COUNT = 0.5, 70, 180
"""Rendered part of a lap, the first image used, and the number of images."""
GATE, GRANTED, FAILED = 10.0, 0.25, 1.0
NEAR_TRAIN = 34.0
"""Pixels up to this distance from the train's centre do not count as static [px]."""
BODY = 0.35
"""Width of a textured body that is drawn into some images, as a share of the window."""
CONDITIONS = {
    "still": {},
    "shake 1 px": {"fault": config.CameraShake(std=1.0)},
    "shake 3 px, slow": {"fault": config.CameraShake(std=3.0, correlation_time=0.1)},
    "shake 1 px, noise 10": {"fault": config.CameraShake(std=1.0), "noise": 10.0},
    "shake 1 px, 20 % darker": {"fault": config.CameraShake(std=1.0), "gain": 0.8},
    "shake 1 px, body": {"fault": config.CameraShake(std=1.0), "body_drawn": True},
    "pan 0.5 px": {"fault": config.CameraPan(rate=0.5, direction_deg=180.0)},
    "knock 1.5 deg": {"fault": config.CameraKnocked(angle_deg=1.5, direction_deg=30.0)},
}
"""The noise is 2 grey levels where nothing else is said, as in the scenario."""
OWN = "robust fit on edges (CameraMotionDetector)"


class PhaseCorrelation:
    """`cv2.phaseCorrelate` with a Hann window: a translation."""

    def __init__(self, reference):
        self._window = cv2.createHanningWindow(reference.shape[::-1], cv2.CV_32F)
        self._reference = np.float32(reference) - np.float32(reference.mean())

    def __call__(self, image):
        (du, dv), _ = cv2.phaseCorrelate(self._reference, np.float32(image) - np.float32(image.mean()), self._window)
        return np.array([[1.0, 0.0, -du], [0.0, 1.0, -dv], [0.0, 0.0, 1.0]])


class SparseFlow:
    """`cv2.goodFeaturesToTrack`, pyramidal Lucas-Kanade flow from the previous estimate, and a RANSAC fit."""

    def __init__(self, reference, model):
        self._reference, self._model, self._last = reference, model, np.eye(3)
        self._points = cv2.goodFeaturesToTrack(cv2.GaussianBlur(reference, (3, 3), 0.8), 300, 0.01, 5)

    def __call__(self, image):
        guess = cv2.perspectiveTransform(self._points, self._last).astype(np.float32)
        flags, criteria = cv2.OPTFLOW_USE_INITIAL_FLOW, (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 0.01)
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            self._reference, image, self._points, guess, winSize=(15, 15), maxLevel=2, criteria=criteria, flags=flags
        )
        kept = status.ravel() == 1
        if kept.sum() < 8:
            return None
        if self._model == "homography":
            H, _ = cv2.findHomography(self._points[kept], found[kept], cv2.RANSAC, 1.0)
        else:
            M, _ = cv2.estimateAffinePartial2D(
                self._points[kept], found[kept], method=cv2.RANSAC, ransacReprojThreshold=1.0
            )
            H = None if M is None else np.vstack([M, [0.0, 0.0, 1.0]])
        if H is None or abs(np.linalg.det(H)) < 0.1:
            return None
        self._last = H
        return np.linalg.inv(H)


class Ecc:
    """`cv2.findTransformECC`, a translation, from the previous estimate; with more parameters it follows the train."""

    def __init__(self, reference):
        self._reference, self._last = reference, np.eye(2, 3, dtype=np.float32)

    def __call__(self, image):
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-5)
        try:
            _, M = cv2.findTransformECC(
                self._reference, image, self._last.copy(), cv2.MOTION_TRANSLATION, criteria, None, 3
            )
        except cv2.error:  # it did not converge
            return None
        self._last = M
        return np.linalg.inv(np.vstack([M, [0.0, 0.0, 1.0]]).astype(float))


class Own:
    """`CameraMotionDetector`; an unusable image has no transform."""

    def __init__(self, reference):
        self._detector = CameraMotionDetector()
        self._reference, self._state = self._detector.reference(reference), self._detector.initial_state()

    def __call__(self, image):
        seen, self._state = self._detector.observe(self._state, image, self._reference)
        return seen.transform


METHODS = {
    "phase correlation": PhaseCorrelation,
    "sparse flow, similarity, RANSAC": lambda reference: SparseFlow(reference, "similarity"),
    "sparse flow, homography, RANSAC": lambda reference: SparseFlow(reference, "homography"),
    "ECC, translation": Ecc,
    OWN: Own,
}


def scene(seed):
    """Returns (the reference, a generator of shots in a condition).

    A shot is (image, true transform to the reference, mask of the static pixels of the reference).
    """
    scenario, sequence = load_scenario("train:learned", seed=seed), train_sequence(seed, LAPS)
    model, window = resolve(scenario).cameras["left"], resolve(scenario).windows["left"]
    u0, v0, width, height = window
    crop, view = np.s_[v0 : v0 + height, u0 : u0 + width], FaultyView("left", model, window)
    K = model.K.copy()
    K[:2, 2] -= (u0, v0)
    pattern = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(height, width)), (0, 0), 2.0)
    body = np.clip(120.0 + 40.0 * pattern / pattern.std(), 0, 255).astype(np.uint8)

    def shots(fault=None, noise=2.0, gain=1.0, body_drawn=False):
        made = make_faults([fault], seed=seed)[0] if fault else None
        sensor = SensorNoise(width=model.width, height=model.height, std=noise, window=window, seed=seed)
        for k in range(COUNT):
            grey, H = sequence.images[FIRST + k][crop].copy(), np.eye(3)
            grey, H = sequence.images[FIRST + k][crop].copy(), np.eye(3)
            rows, columns = np.indices(grey.shape)
            u, v = sequence.uv[FIRST + k] - (u0, v0)
            static = np.hypot(columns - u, rows - v) > NEAR_TRAIN
            if body_drawn:
                wide = round(BODY * width)
                place = 2 * k % (width - wide)
                grey[:, place : place + wide], static[:, place : place + wide] = body[:, :wide], False
            image = cv2.cvtColor(cv2.convertScaleAbs(grey, alpha=gain), cv2.COLOR_GRAY2RGBA)
            sensor.add(image, k * VISION_PERIOD, out=image)
            if made:
                image = made.image(image, view, k * VISION_PERIOD, None)
                H = turned(K, made.turn("left", K, k * VISION_PERIOD))
            yield cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY), np.linalg.inv(H), static

    return sequence.empty[crop].copy(), shots


def distance(found, true, shape):
    """Returns the root mean square distance between pixels of an image moved by two transforms [px]."""
    v, u = np.mgrid[4 : shape[0] : 8, 4 : shape[1] : 8]
    points = np.stack([u, v], axis=-1).reshape(1, -1, 2).astype(float)
    moved = [cv2.perspectiveTransform(points, transform) for transform in (found, true)]
    return float(np.sqrt(np.mean(np.sum((moved[0] - moved[1]) ** 2, axis=2))))


def measure(seeds):
    """Returns {condition: {method: results}}."""
    results = {condition: {name: [] for name in ["none", *METHODS]} for condition in CONDITIONS}
    for seed in seeds:
        reference, shots = scene(seed)
        tolerance = edge_tolerance(reference, GRANTED)
        for condition, settings in CONDITIONS.items():
            methods = {"none": lambda image: np.eye(3)}
            methods.update({name: make(reference) for name, make in METHODS.items()})
            for image, truth, static in shots(**settings):
                for name, method in methods.items():
                    start = time.perf_counter()
                    found = method(image)
                    elapsed = time.perf_counter() - start
                    line = {"error": np.inf, "s": elapsed, "false": np.nan, "granted": np.nan}
                    if found is not None:
                        aligned, missing = align(image, found)
                        difference = cv2.absdiff(aligned, reference).astype(float)[static & (missing == 0)]
                        granted = tolerance[static & (missing == 0)]
                        line["error"] = distance(found, truth, image.shape)
                        if len(difference):
                            line["false"] = float(np.mean(difference > GATE))
                            line["granted"] = float(np.mean(difference > GATE + granted))
                    results[condition][name].append(line)
    return {
        condition: {name: summary(lines) for name, lines in methods.items()} for condition, methods in results.items()
    }


def summary(lines):
    """Returns the numbers of one method in one condition."""
    errors = np.array([line["error"] for line in lines])
    found = errors[np.isfinite(errors)]
    return {
        "median_px": float(np.median(found)) if len(found) else None,
        "p95_px": float(np.percentile(found, 95)) if len(found) else None,
        "failed": float(np.mean(~(errors < FAILED))),
        "false_pixels": float(np.nanmean([line["false"] for line in lines])) if len(found) else None,
        "granted": float(np.nanmean([line["granted"] for line in lines])) if len(found) else None,
        "median_ms": 1e3 * float(np.median([line["s"] for line in lines])),
    }


def table(methods, timed):
    """Returns (header, rows) of the methods in one condition."""
    header = ["method", "median error [px]", "95 %", "failed", "false pixels", "granted"] + ["time [ms]"] * timed
    rows = []
    for name, result in methods.items():
        texts = [name, *("-" if result[key] is None else f"{result[key]:.3f}" for key in ("median_px", "p95_px"))]
        texts += ["-" if result[key] is None else f"{100 * result[key]:.1f} %" for key in ("failed", "false_pixels")]
        texts += ["-" if result["granted"] is None else f"{100 * result['granted']:.2f} %"]
        rows.append(texts + [f"{result['median_ms']:.2f}"] * timed)
    return header, rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2, help="number of scenarios (default 2)")
    parser.add_argument("--time", action="store_true", help="also report the time of one image")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    seeds = range(args.seeds)
    results = measure(seeds)
    for condition, methods in results.items():
        print(f"{condition}: {args.seeds * COUNT} images")
        print_table(*table(methods, args.time))
    if not args.time:
        for methods in results.values():
            for result in methods.values():
                del result["median_ms"]
    save_json({"opencv": cv2.__version__, "images": args.seeds * COUNT, "conditions": results}, args.json, seeds)


if __name__ == "__main__":
    main()
