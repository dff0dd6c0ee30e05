"""Calibration files of OpenCV: FileStorage, as YAML, XML or JSON.

Sources: OpenCV, "XML/YAML/JSON file storages"; the keys are those of its samples stereo_calib.cpp (M1, D1, M2, D2 in
intrinsics.yml, R, T in extrinsics.yml) and camera_calibration.cpp (camera_matrix, distortion_coefficients,
fisheye_model), and of its interactive-calibration tool. x_R = R x_L + T, in the unit of the board.
"""

import xml.etree.ElementTree
from collections.abc import Mapping
from typing import Any, ClassVar

import cv2
import numpy as np
import yaml

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.foreign_camera import (
    UNKNOWN_SIZE,
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
from drake_tracker.core.files.bounded_yaml import BoundedLoader

_MATRICES = ("M", "K", "cameraMatrix", "camera_matrix", "intrinsic_matrix", "camera_matrix_")
_LENSES = ("D", "distCoeffs", "dist_coeffs", "distortion_coefficients", "distortion", "distCoeffs_")
_SIZES = ("image_size", "imageSize", "cameraResolution", "size")
_DEEPEST = 16
"""Greatest number of XML elements within each other."""


class _FileStorageLoader(BoundedLoader):
    """The bounded loader, which also reads the matrices of OpenCV, as mappings."""

    yaml_constructors: ClassVar[dict[str, Any]] = {
        **BoundedLoader.yaml_constructors,
        "tag:yaml.org,2002:opencv-matrix": BoundedLoader.construct_yaml_map,
        "tag:yaml.org,2002:opencv-nd-matrix": BoundedLoader.construct_yaml_map,
    }


def is_file_storage(text: str) -> bool:
    """Returns whether a text is a FileStorage of OpenCV, by its first characters."""
    start = text.lstrip("\ufeff \r\n\t")[:300]
    return start.startswith(("%YAML:1.0", "<?xml", "<opencv_storage")) or "!!opencv-matrix" in text


def parse_file_storage(path: str, text: str) -> dict[str, Any]:
    """Returns the content of a FileStorage as plain values.

    Args:
        path: of the file, for messages.
        text: its content.

    Raises DrakeTrackerError or yaml.YAMLError when it is not one, or exceeds the limits.
    """
    text = text.lstrip("\ufeff \r\n\t")
    if text.startswith("<"):
        return _parse_xml(path, text)
    if text.startswith("%YAML"):
        text = text.partition("\n")[2]
    data = yaml.load(text, _FileStorageLoader)
    if not isinstance(data, dict):
        raise DrakeTrackerError(f"{path}: this FileStorage has no keys")
    return data


def _parse_xml(path: str, text: str) -> dict[str, Any]:
    if "<!" in text.replace("<!--", ""):
        raise DrakeTrackerError(f"{path}: XML with a document type or entities is not read")
    try:
        root = xml.etree.ElementTree.fromstring(text)
    except (xml.etree.ElementTree.ParseError, ValueError) as error:
        raise DrakeTrackerError(f"{path}: this is not XML ({str(error)[:60]})") from None
    return {child.tag: _xml_value(path, child, 0) for child in root}


def _xml_value(path: str, element: xml.etree.ElementTree.Element, depth: int) -> Any:
    """Returns an element as a mapping, a list of numbers, a number or a text."""
    if depth > _DEEPEST:
        raise DrakeTrackerError(f"{path}: elements are nested too deeply")
    if len(element):
        return {child.tag: _xml_value(path, child, depth + 1) for child in element}
    values: list[Any] = []
    for word in (element.text or "").split():
        try:
            values.append(int(word) if word.lstrip("+-").isdigit() and len(word) < 20 else float(word))
        except ValueError:
            return (element.text or "").strip()
    return values[0] if len(values) == 1 and element.tag != "data" else values


def is_opencv(data: Mapping[str, Any]) -> bool:
    """Returns whether a mapping has the keys of a calibration of OpenCV."""
    return any(first_of(data, [f"{name}{k}" for name in _MATRICES]) for k in ("1", "")) or {"R", "T"} <= set(data)


def read_opencv(path: str, data: Mapping[str, Any]) -> dict[str, Entry]:
    """Returns {name: entry} of a calibration of OpenCV.

    Args:
        path: of the file or files, for messages.
        data: their content.

    Raises DrakeTrackerError when something is missing or wrong.
    """
    if first_of(data, [f"{name}1" for name in _MATRICES]) is None:
        return {"camera_left": _read_camera(path, data, "")}
    left, right = (_read_camera(path, data, number) for number in "12")
    if not {"R", "T"} <= set(data):
        raise DrakeTrackerError(
            f"{path}: R and T are missing, the pose of the second camera; give the file with the extrinsics as well"
        )
    R, T = matrix(path, "R", data["R"], (3, 3), (3,)), matrix(path, "T", data["T"], (3,))
    right["X_CW"] = pose(path, "R", R if R.shape == (3, 3) else cv2.Rodrigues(R)[0], T)
    return {"camera_left": left, "camera_right": right}


def _read_camera(path: str, data: Mapping[str, Any], number: str) -> Entry:
    key = first_of(data, [name + number for name in _MATRICES])
    lens = first_of(data, [name + number for name in _LENSES])
    if key is None or lens is None:
        what = (
            f"{'M' + number if number else 'camera_matrix'} and {'D' + number if number else 'distortion_coefficients'}"
        )
        raise DrakeTrackerError(f"{path}: {what} are missing, the camera matrix and the distortion")
    size = (UNKNOWN_SIZE, UNKNOWN_SIZE)
    if "image_width" in data and "image_height" in data:
        size = image_size(path, data["image_width"], data["image_height"])
    elif (name := first_of(data, [f"{each}{number}" for each in _SIZES] + list(_SIZES))) is not None:
        width, height = matrix(path, name, data[name], (2,))
        size = image_size(path, width, height)
    make = fisheye_entry if data.get("fisheye_model") in (1, True) else pinhole_entry
    return make(path, lens, size, matrix(path, key, data[key], (3, 3)), matrix(path, lens, data[lens]))


def opencv_text(cameras: Mapping[str, CameraModel], suffix: str) -> str:
    """Returns a FileStorage with the keys of OpenCV's samples.

    Args:
        cameras: one camera, or the left and the right one; W is the frame of the left one.
        suffix: of the file: .xml and .json choose these formats, any other YAML.
    """
    name = f"cameras{suffix if suffix in ('.xml', '.json') else '.yml'}"
    file = cv2.FileStorage(name, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    left = next(iter(cameras.values()))
    file.write("image_width", left.width)
    file.write("image_height", left.height)
    keys = [("camera_matrix", "distortion_coefficients")] if len(cameras) == 1 else [("M1", "D1"), ("M2", "D2")]
    for number, ((K, D), camera) in enumerate(zip(keys, cameras.values()), 1):
        file.write(K, np.array(camera.K))
        file.write(D, camera.distortion.reshape(1, -1))
        if len(cameras) == 2:
            file.write(f"image_size{number}", np.array([[camera.width, camera.height]], dtype=np.int32))
    file.write("fisheye_model", int(left.lens == FISHEYE))
    if len(cameras) == 2:
        X_RL = list(cameras.values())[1].X_CW
        file.write("R", X_RL[:3, :3].copy())
        file.write("T", X_RL[:3, 3:].copy())
    # OpenCV 5 writes the version of YAML in a way that the first versions of OpenCV 4 do not read.
    return str(file.releaseAndGetString()).replace("%YAML 1.2", "%YAML:1.0", 1)
