"""How many points of somebody who walks `drake-tracker track` filters, for `footage.py`."""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from footage_parts.clips import HEIGHT, RATE, WIDTH, make_clip

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration
from drake_tracker.own_cameras import make_track, prepare_track

FOCUS, DISTANCE = 800.0, 8.0
"""Focal length of the camera [px], and its distance from the plane in which the figure walks [m]: 1 px is 1 cm."""
CELLS = {"metres": 1.0, "millimetres": 1000.0}
"""{unit of the calibration: of them in a metre}."""


def job(cell, seed, quick):
    """Returns the line of a clip: numbers of points, and the error of the predictions [m]."""
    unit = CELLS[cell]
    clip = make_clip("person", seed)
    K = np.array([[FOCUS, 0.0, 0.5 * (WIDTH - 1)], [0.0, FOCUS, 0.5 * (HEIGHT - 1)], [0.0, 0.0, 1.0]])
    X_CW = np.diag([1.0, -1.0, -1.0, 1.0])
    X_CW[2, 3] = DISTANCE * unit
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "images").mkdir()
        for k, image in enumerate(clip.images):
            cv2.imwrite(str(folder / "images" / f"{k:04d}.png"), image)
        camera = CameraModel(K, np.zeros(5), X_CW, WIDTH, HEIGHT)
        save_calibration(folder / "camera.yaml", {"camera_left": camera}, notes={"X_WP": np.eye(4).tolist()})
        (folder / "out").mkdir()
        options = {"fps": RATE, "calibration": folder / "camera.yaml", "plane": "board"}
        made = make_track(prepare_track([str(folder / "images")], **options), folder / "out", overlay=False)
        table = np.genfromtxt(folder / "out" / "track.csv", delimiter=",", names=True)
    counts = made["filtered"]
    return {
        "points": counts["points"],
        "filtered": counts["filtered"],
        "predicted": int(np.isfinite(table["predicted_x"]).sum()),
        "prediction_rms_m": made["prediction_rms_m"] / unit,
    }


def summary(rows):
    """Returns the results of a cell."""
    sums = {key: sum(row[key] for row in rows) for key in ("points", "filtered", "predicted")}
    errors = [row["prediction_rms_m"] for row in rows]
    return {"clips": len(rows), **sums, "prediction_rms_m": float(np.sqrt(np.mean(np.square(errors))))}
