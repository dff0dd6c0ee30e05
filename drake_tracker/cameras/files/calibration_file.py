"""The YAML file that keeps calibrated cameras."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.lens_models import COEFFICIENTS, FISHEYE, PINHOLE
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.bounded_yaml import load_yaml
from drake_tracker.core.files.regular_file import read_text

_CAMERA_ARRAYS = ("K", "distortion", "X_CW")
_DIGITS = 9
_ROTATION_TOLERANCE = 1e-6
_MOST_PIXELS = 100_000
"""Greatest width, height, focal length and coordinate of a centre [px]; a telescope of an amateur has 50,000."""
_FARTHEST = 1e4
"""Greatest coordinate of a position [m], and greatest coefficient of distortion."""


def save_calibration(
    path: str | Path,
    cameras: Mapping[str, CameraModel],
    *,
    rig: Mapping[str, Any] | None = None,
    notes: Mapping[str, Any] | None = None,
) -> None:
    """Writes {name: CameraModel} to a YAML file.

    Args:
        path: of the file.
        cameras: the calibrated cameras by name.
        rig: {setting: value}, the arrangement of cameras for which the file is valid: numbers, texts and lists.
        notes: {name: value}, anything worth keeping, such as the board and the errors: numbers, texts and lists.

    Raises DrakeTrackerError when the file cannot be written; an existing file is then left unchanged.
    """
    data: dict[str, Any] = {"rig": rig or {}, "notes": notes or {}, "cameras": {}}
    for name, camera in cameras.items():
        lens = {} if camera.lens == PINHOLE else {"lens": camera.lens}
        data["cameras"][name] = {"width": camera.width, "height": camera.height, **lens} | {
            key: np.round(getattr(camera, key), _DIGITS).tolist() for key in _CAMERA_ARRAYS
        }
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=120)
    write_text(path, "# Camera matrices found from images of a chessboard.\n" + text)


def load_calibration(path: str | Path, rig: Mapping[str, Any] | None = None) -> dict[str, CameraModel]:
    """Returns {name: CameraModel} from a file that `save_calibration` wrote.

    Args:
        path: of the file.
        rig: {setting: value} that the file must agree with; None accepts any.

    Raises DrakeTrackerError, one line naming the file and the key, when the file is missing or not YAML, a value is
    missing, of another shape or not finite, when X_CW is not a pose or K not a camera matrix, or when the rig differs.
    """
    data = _read_yaml(path)
    entries = _mapping(path, data, "cameras")
    if rig is not None:
        check_rig(path, _mapping(path, data, "rig"), rig, "calibrate")
    return {name: read_camera(path, f"cameras.{name}", _mapping(path, entries, name)) for name in entries}


def load_pose(path: str | Path, *keys: str) -> np.ndarray:
    """Returns the pose (4, 4) at a path of keys in a YAML file.

    Raises DrakeTrackerError, one line naming the file and the key, when the file cannot be read or it is not a pose.
    """
    entry, name = _read_yaml(path), ".".join(keys)
    for key in keys:
        entry = entry.get(key) if isinstance(entry, dict) else None
    try:
        X = np.array(entry, dtype=float)
    except (TypeError, ValueError, OverflowError):
        X = np.empty(0)
    if X.shape != (4, 4) or not _is_pose(X) or np.abs(X).max() > _FARTHEST:
        raise DrakeTrackerError(
            f"{path}: {name} must contain 4 x 4 numbers, a rotation and a translation above 0 0 0 1"
        )
    return X


def _read_yaml(path: str | Path) -> Any:
    try:
        return load_yaml(read_calibration_text(path))
    except yaml.YAMLError as error:
        raise yaml_error(path, error) from None


def read_calibration_text(path: str | Path) -> str:
    """Returns the text of a calibration file.

    Raises DrakeTrackerError, one line naming the file, when it cannot be read.
    """
    try:
        return read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise DrakeTrackerError(
            f"{path}: the calibration cannot be read ({getattr(error, 'strerror', None) or 'it is not text'}); "
            "make one with drake-tracker calibrate"
        ) from None


def yaml_error(path: str | Path, error: yaml.YAMLError) -> DrakeTrackerError:
    """Returns the error of a file that is not YAML, as one line naming the file and the line."""
    mark = getattr(error, "problem_mark", None)
    where = f" line {mark.line + 1}" if mark else ""
    return DrakeTrackerError(f"{path}{where}: {getattr(error, 'problem', None) or 'this is not YAML'}")


def _mapping(path: str | Path, data: Any, key: str) -> dict[str, Any]:
    value = data.get(key) if isinstance(data, dict) else None
    if not isinstance(value, dict):
        raise DrakeTrackerError(f"{path}: {key} is missing or not a mapping")
    return value


def check_rig(path: str | Path, found: Any, wanted: Mapping[str, Any], command: str) -> None:
    """Raises DrakeTrackerError when a file was made for cameras that differ from the cameras of the scenario.

    Args:
        path: of the file, for the message.
        found: the file's ``rig``, as `world.imaging.cameras.describe_rig` returns it.
        wanted: the scenario's.
        command: of drake-tracker, which makes such a file.
    """
    for key, value in wanted.items():
        own = found.get(key) if isinstance(found, dict) else None
        try:
            numbers = np.array(own, dtype=float)
        except (TypeError, ValueError, OverflowError):
            numbers = np.array(np.nan)
        if numbers.shape != np.shape(value) or not np.allclose(numbers, value):
            raise DrakeTrackerError(
                f"{path}: made with rig.{key} = {str(own)[:60]}, but the scenario's cameras have {value}; make it "
                f"again with drake-tracker {command}"
            )


def read_camera(path: str | Path, key: str, entry: Mapping[str, Any], least_size: int = 1) -> CameraModel:
    """Returns the camera of an entry of a file.

    Args:
        path: of the file, for messages.
        key: of the entry, for messages.
        entry: width, height, K, distortion, X_CW and, unless it is a pinhole, lens.
        least_size: least width and height [px].

    Raises DrakeTrackerError, one line naming the file and the key, when a value is wrong.
    """
    sizes: dict[str, int] = {}
    arrays: dict[str, np.ndarray] = {}
    for name in ("width", "height"):
        size = entry.get(name)
        if type(size) is not int or not least_size <= size <= _MOST_PIXELS:
            raise DrakeTrackerError(
                f"{path}: {key}.{name} is {size!r}; it must be a whole number from 1 to {_MOST_PIXELS}"
            )
        sizes[name] = size
    lens = entry.get("lens", PINHOLE)
    if lens not in (PINHOLE, FISHEYE):
        raise DrakeTrackerError(f"{path}: {key}.lens is {str(lens)[:60]!r}; it must be {PINHOLE} or {FISHEYE}")
    for name, shapes in (("K", [(3, 3)]), ("distortion", [(n,) for n in COEFFICIENTS[lens]]), ("X_CW", [(4, 4)])):
        try:
            arrays[name] = np.array(entry.get(name), dtype=float)
        except (TypeError, ValueError, OverflowError):
            arrays[name] = np.empty(0)
        if arrays[name].shape not in shapes or not np.isfinite(arrays[name]).all():
            wanted = " or ".join(" x ".join(map(str, shape)) for shape in shapes)
            raise DrakeTrackerError(f"{path}: {key}.{name} must contain {wanted} finite numbers")
        most = _MOST_PIXELS if name == "K" else _FARTHEST
        if np.abs(arrays[name]).max() > most:
            raise DrakeTrackerError(f"{path}: {key}.{name} has a number beyond {most:g}, which no camera has")
    K, X_CW = arrays["K"], arrays["X_CW"]
    if K[0, 0] <= 0.0 or K[1, 1] <= 0.0 or not np.allclose(K[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]], [0, 0, 0, 0, 1]):
        raise DrakeTrackerError(f"{path}: {key}.K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above 0")
    if not _is_pose(X_CW):
        raise DrakeTrackerError(f"{path}: {key}.X_CW must be a rotation and a translation, last row 0 0 0 1")
    return CameraModel(arrays["K"], arrays["distortion"], arrays["X_CW"], sizes["width"], sizes["height"], lens)


def _is_pose(X: np.ndarray) -> bool:
    R = X[:3, :3]
    proper = np.allclose(R @ R.T, np.eye(3), atol=_ROTATION_TOLERANCE) and np.linalg.det(R) > 0.0
    return bool(proper and np.isfinite(X).all() and np.array_equal(X[3], [0.0, 0.0, 0.0, 1.0]))
