"""Two videos of the same object by calibrated cameras, for the speed of `drake-tracker track` in `footage.py`."""

import numpy as np
from footage_parts import files as footage_files
from footage_parts.clips import NOISE, RATE, background, disc, paint

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration

WIDTH, HEIGHT = 1088, 1920
FOCUS, BASELINE, DISTANCE, RADIUS = 1400.0, 0.3, 2.0, 0.25
"""Focal length [px]; distance between the cameras, to the object, and radius of its path [m]."""
DIAMETER, PERIOD = 80.0, 3.0
"""Of the object [px], and time of one lap [s]."""
NOISES = 7
"""Number of different images of noise, which are used in turn."""


def write_pair(folder, seed, count):
    """Writes left.mp4 and right.mp4 of ``count`` images each, and stereo.yaml, to a folder."""
    rng = np.random.default_rng(seed)
    K = np.array([[FOCUS, 0.0, 0.5 * (WIDTH - 1)], [0.0, FOCUS, 0.5 * (HEIGHT - 1)], [0.0, 0.0, 1.0]])
    cameras = {}
    for side, x in (("left", 0.0), ("right", BASELINE)):
        X_CW = np.eye(4)
        X_CW[0, 3] = -x
        cameras[f"camera_{side}"] = CameraModel(K, np.zeros(5), X_CW, WIDTH, HEIGHT)
    save_calibration(folder / "stereo.yaml", cameras)
    angle = 2.0 * np.pi / (RATE * PERIOD) * np.arange(count)
    p_WQ = np.column_stack([0.5 * BASELINE + RADIUS * np.cos(angle), RADIUS * np.sin(angle), np.full(count, DISTANCE)])
    thing = disc(rng, DIAMETER, 225.0)
    for name, camera in cameras.items():
        sky = background(rng, WIDTH, HEIGHT)
        noises = [rng.normal(0.0, NOISE, sky.shape).astype(np.float32) for _ in range(NOISES)]
        images = []
        for k, centre in enumerate(camera.project(p_WQ)):
            image = sky + noises[k % NOISES]
            paint(image, thing, centre, k)
            images.append(np.clip(np.rint(image), 0, 255).astype(np.uint8))
        path = folder / f"{name.removeprefix('camera_')}.mp4"
        footage_files.write(path, footage_files.FILES["H.264 in MP4"], images, None)
