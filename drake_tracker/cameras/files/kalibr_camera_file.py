"""Calibration files of Kalibr: camchain, one YAML file for all cameras.

Source: Kalibr's wiki, "YAML formats" and "Supported models". T_cn_cnm1 takes points from the frame of the previous
camera to the frame of the camera. ``radtan`` has k1, k2, p1, p2 of OpenCV's pinhole, and ``equidistant`` is OpenCV's
fisheye.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.foreign_camera import Entry, fisheye_entry, image_size, matrix, pinhole_entry, pose
from drake_tracker.cameras.lens_models import FISHEYE
from drake_tracker.core.errors import DrakeTrackerError

_NAMES = ("camera_left", "camera_right")


def is_camchain(data: Mapping[str, Any]) -> bool:
    """Returns whether a mapping is a camchain of Kalibr."""
    return isinstance(data.get("cam0"), dict)


def read_kalibr(path: str, data: Mapping[str, Any]) -> dict[str, Entry]:
    """Returns {name: entry}: camera_left for cam0, camera_right for cam1, and cam2, cam3, ... as they are.

    Args:
        path: of the file, for messages.
        data: its content.

    Raises DrakeTrackerError when something is missing or wrong.
    """
    entries: dict[str, Entry] = {}
    X_CW = np.eye(4)
    while isinstance(camera := data.get(key := f"cam{len(entries)}"), dict):
        entry = _read_camera(path, key, camera)
        if entries:
            X = matrix(path, f"{key}.T_cn_cnm1", camera.get("T_cn_cnm1"), (4, 4))
            X_CW = pose(path, f"{key}.T_cn_cnm1", X[:3, :3], X[:3, 3]) @ X_CW
            entry["X_CW"] = X_CW
        entries[_NAMES[len(entries)] if len(entries) < len(_NAMES) else key] = entry
    return entries


def _read_camera(path: str, key: str, camera: Mapping[str, Any]) -> Entry:
    if camera.get("camera_model") != "pinhole":
        raise DrakeTrackerError(f"{path}: {key}.camera_model is {str(camera.get('camera_model'))[:40]!r}; only pinhole")
    fu, fv, pu, pv = matrix(path, f"{key}.intrinsics", camera.get("intrinsics"), (4,))
    K = np.array([[fu, 0.0, pu], [0.0, fv, pv], [0.0, 0.0, 1.0]])
    size = image_size(path, *matrix(path, f"{key}.resolution", camera.get("resolution"), (2,)))
    model, name = camera.get("distortion_model"), f"{key}.distortion_coeffs"
    if model == "none":
        return pinhole_entry(path, name, size, K, np.zeros(4))
    if model not in ("radtan", "equidistant"):
        raise DrakeTrackerError(
            f"{path}: {key}.distortion_model is {str(model)[:40]!r}; it must be radtan, equidistant or none"
        )
    make = fisheye_entry if model == "equidistant" else pinhole_entry
    return make(path, name, size, K, matrix(path, name, camera.get("distortion_coeffs"), (4,)))


def kalibr_text(cameras: Mapping[str, CameraModel]) -> str:
    """Returns the camchain of cameras.

    Args:
        cameras: in the order of the chain; W is the frame of the first one.

    Raises DrakeTrackerError when a lens has coefficients that Kalibr does not know.
    """
    data: dict[str, Any] = {}
    before = np.eye(4)
    for k, (name, camera) in enumerate(cameras.items()):
        if camera.lens != FISHEYE and camera.distortion[4:].any():
            raise DrakeTrackerError(
                f"--format kalibr: {name} has more coefficients than k1, k2, p1, p2; take --lens pinhole or fisheye"
            )
        entry: dict[str, Any] = {
            "cam_overlaps": [other for other in range(len(cameras)) if other != k],
            "camera_model": "pinhole",
            "distortion_coeffs": camera.distortion[:4].tolist(),
            "distortion_model": "equidistant" if camera.lens == FISHEYE else "radtan",
            "intrinsics": camera.K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(),
            "resolution": [camera.width, camera.height],
            "rostopic": f"/cam{k}/image_raw",
        }
        if k:
            entry["T_cn_cnm1"] = (camera.X_CW @ np.linalg.inv(before)).tolist()
        before = camera.X_CW
        data[f"cam{k}"] = entry
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=120)
