"""Calibration files of ROS: camera_info, one YAML file for each camera.

Sources: ROS, message sensor_msgs/CameraInfo, and the package camera_calibration_parsers for the keys of the file. R
takes the camera's frame to the rectified one, and the fourth column of P places the second camera: Tx = -fx' B at a
distance B to the right of the first one. Size, K and P describe the full image; binning and region of interest say
which part of it the images show, and how much it is reduced (REP 104).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
import yaml

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.foreign_camera import (
    Entry,
    first_of,
    fisheye_entry,
    image_size,
    matrix,
    pinhole_entry,
    pose,
)
from drake_tracker.cameras.lens_models import FISHEYE
from drake_tracker.core.errors import DrakeTrackerError

_KEYS = {
    "width": ("image_width", "width"),
    "height": ("image_height", "height"),
    "K": ("camera_matrix", "K", "k"),
    "D": ("distortion_coefficients", "D", "d"),
    "R": ("rectification_matrix", "R", "r"),
    "P": ("projection_matrix", "P", "p"),
}
"""Names in a file of camera_calibration_parsers, and in a message that was printed."""
_PINHOLES, _FISHEYES = ("plumb_bob", "rational_polynomial"), ("equidistant", "fisheye")


def is_camera_info(data: Mapping[str, Any]) -> bool:
    """Returns whether a mapping is a camera_info of ROS."""
    return "distortion_model" in data and all(first_of(data, _KEYS[key]) for key in ("width", "K", "D"))


def read_ros(paths: Sequence[str], infos: Sequence[Mapping[str, Any]]) -> dict[str, Entry]:
    """Returns {name: entry} of one camera, or of the left and the right one.

    Args:
        paths: of the files, for messages.
        infos: their content.

    Raises DrakeTrackerError when something is missing or wrong.
    """
    entries = [_read_camera(path, info) for path, info in zip(paths, infos)]
    if len(entries) == 1:
        return {"camera_left": entries[0]}
    (R_left, t_left), (R_right, t_right) = (_rectification(path, info) for path, info in zip(paths, infos))
    baseline = t_right - t_left
    if not baseline.any():
        raise DrakeTrackerError(
            f"{paths[1]}: projection_matrix has no distance to the other camera (its fourth number is 0); calibrate "
            "both cameras together"
        )
    # p_R = R_right^T (R_left p_L + baseline)
    entries[1]["X_CW"] = pose(paths[1], "rectification_matrix", R_right.T @ R_left, R_right.T @ baseline)
    return dict(zip(("camera_left", "camera_right"), entries))


def _get(path: str, info: Mapping[str, Any], key: str) -> tuple[str, Any]:
    name = first_of(info, _KEYS[key])
    if name is None:
        raise DrakeTrackerError(f"{path}: {_KEYS[key][0]} is missing")
    return name, info[name]


def _read_camera(path: str, info: Mapping[str, Any]) -> Entry:
    size = image_size(path, _get(path, info, "width")[1], _get(path, info, "height")[1])
    K = matrix(path, *_get(path, info, "K"), (3, 3))
    size, K = _as_captured(path, info, size, K)
    name, value = _get(path, info, "D")
    model = info["distortion_model"]
    if model in ("", *_PINHOLES, *_FISHEYES) and value in ([], {"rows": 1, "cols": 0, "data": []}):
        return pinhole_entry(path, name, size, K, np.zeros(5))  # a simulator's camera without distortion
    if model in _PINHOLES:
        return pinhole_entry(path, name, size, K, matrix(path, name, value))
    if model in _FISHEYES:
        return fisheye_entry(path, name, size, K, matrix(path, name, value))
    raise DrakeTrackerError(
        f"{path}: distortion_model is {str(model)[:40]!r}; it must be one of {', '.join(_PINHOLES + _FISHEYES)}"
    )


def _as_captured(
    path: str, info: Mapping[str, Any], size: tuple[int, int], K: np.ndarray
) -> tuple[tuple[int, int], np.ndarray]:
    """Returns size and camera matrix of the images, given those of the full image.

    Full pixel u is pixel (u - x_offset + 1/2) / binning - 1/2 of the image, because pixel centres are whole numbers.
    A missing or zero binning is 1; a region of zero size is the full image.
    """
    roi = info.get("roi") or {}
    if not isinstance(roi, Mapping):
        raise DrakeTrackerError(f"{path}: roi must have x_offset, y_offset, width and height")
    K, captured = K.copy(), []
    for axis, (length, side, offset, binning) in enumerate(
        (("width", size[0], "x_offset", "binning_x"), ("height", size[1], "y_offset", "binning_y"))
    ):
        values = (roi.get(offset) or 0, roi.get(length) or side, info.get(binning) or 1)
        if not all(isinstance(value, int) and value >= 0 for value in values) or values[0] + values[1] > side:
            raise DrakeTrackerError(
                f"{path}: roi.{offset}, roi.{length} and {binning} are {', '.join(str(v)[:20] for v in values)}; they "
                f"must be whole, and the region within the {length} of {side} px"
            )
        first, extent, reduction = values
        if extent < reduction:
            raise DrakeTrackerError(f"{path}: {binning} is {reduction} for a region of {extent} px")
        captured.append(extent // reduction)
        K[axis] /= reduction
        K[axis, 2] = (K[axis, 2] * reduction - first + 0.5) / reduction - 0.5
    return (captured[0], captured[1]), K


def _rectification(path: str, info: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the rotation to the rectified frame, and the position of the first camera in it [m]."""
    R = matrix(path, *_get(path, info, "R"), (3, 3))
    P = matrix(path, *_get(path, info, "P"), (3, 4))
    if not (P[0, 0] > 0.0 and P[1, 1] > 0.0):
        raise DrakeTrackerError(f"{path}: projection_matrix must have focal lengths above 0")
    return R, np.array([P[0, 3] / P[0, 0], P[1, 3] / P[1, 1], 0.0])


def ros_texts(cameras: Mapping[str, CameraModel]) -> dict[str, str]:
    """Returns {name: text of a camera_info file}, rectified as OpenCV does.

    Args:
        cameras: one camera, or the left and the right one, of which W is the frame of the left one.

    Raises DrakeTrackerError when the kinds of lens or the sizes of image differ.
    """
    left = next(iter(cameras.values()))
    K = np.hstack([left.K, np.zeros((3, 1))])
    rectified = [(np.eye(3), K)]
    if len(cameras) == 2:
        right = list(cameras.values())[1]
        size = (left.width, left.height)
        if right.lens != left.lens or (right.width, right.height) != size:
            raise DrakeTrackerError("--format ros: both cameras must have the same lens and size of image")
        X_RL = right.X_CW
        arguments = (left.K, left.distortion, right.K, right.distortion, size, X_RL[:3, :3].copy(), X_RL[:3, 3:].copy())
        if left.lens == FISHEYE:
            R1, R2, P1, P2, _ = cv2.fisheye.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY)
        else:
            R1, R2, P1, P2, *_ = cv2.stereoRectify(*arguments, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
        rectified = [(R1, P1), (R2, P2)]
    return {name: _text(name, camera, *each) for (name, camera), each in zip(cameras.items(), rectified)}


def _text(name: str, camera: CameraModel, R: np.ndarray, P: np.ndarray) -> str:
    def entry(array: np.ndarray) -> dict[str, Any]:
        return {"rows": array.shape[0], "cols": array.shape[1], "data": array.ravel().tolist()}

    model = "equidistant" if camera.lens == FISHEYE else _PINHOLES[len(camera.distortion) == 8]
    data = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "camera_matrix": entry(camera.K),
        "distortion_model": model,
        "distortion_coefficients": entry(camera.distortion.reshape(1, -1)),
        "rectification_matrix": entry(R),
        "projection_matrix": entry(P),
    }
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=120)
