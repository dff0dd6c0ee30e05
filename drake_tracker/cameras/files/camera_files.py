"""Reads and writes calibrations as files of this package, OpenCV, ROS or Kalibr. The content tells whose a file is."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import (
    load_calibration,
    read_calibration_text,
    read_camera,
    yaml_error,
)
from drake_tracker.cameras.files.foreign_camera import UNKNOWN_SIZE, Entry
from drake_tracker.cameras.files.kalibr_camera_file import is_camchain, kalibr_text, read_kalibr
from drake_tracker.cameras.files.opencv_camera_file import (
    is_file_storage,
    is_opencv,
    opencv_text,
    parse_file_storage,
    read_opencv,
)
from drake_tracker.cameras.files.ros_camera_file import is_camera_info, read_ros, ros_texts
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.bounded_yaml import load_yaml

OWN, OPENCV, ROS, KALIBR = "drake", "opencv", "ros", "kalibr"
FORMATS = (OWN, OPENCV, ROS, KALIBR)
"""Formats of calibration files."""
_FURTHER_MESSAGES = re.compile(r"(?<=\S)\s*^---\s*$.*", re.MULTILINE | re.DOTALL)
"""The end of the first message that ``ros2 topic echo`` printed, and the messages after it."""
_SECTION = re.compile(r"^\[+\w+\]+\s*$", re.MULTILINE)
"""The title of a section in an INI or TOML file."""
_OF = {OWN: "drake-tracker", OPENCV: "OpenCV", ROS: "ROS", KALIBR: "Kalibr"}


def load_cameras(paths: Sequence[str | Path]) -> tuple[dict[str, CameraModel], str]:
    """Returns ({name: CameraModel}, format) of a calibration in one file or two.

    The cameras are camera_left and, of a pair, camera_right. In files of other tools, W is the frame of the first
    camera, and width and height are `UNKNOWN_SIZE` where the file does not contain them.

    Args:
        paths: one file; of OpenCV also intrinsics and extrinsics, of ROS one file for each camera.

    Raises DrakeTrackerError, one line naming the file, when a file cannot be read, nobody's format is recognised, or
    the files do not belong together.
    """
    names = [str(path) for path in paths]
    if len(names) > 2 or len(set(names)) < len(names):
        raise DrakeTrackerError(f"--calibration {' '.join(names)}: give one file, or two different ones")
    contents = [_parse(name) for name in names]
    kinds = [kind for kind, _ in contents]
    if len(set(kinds)) > 1:
        raise DrakeTrackerError(f"{names[1]} is a file of {_OF[kinds[1]]}, {names[0]} one of {_OF[kinds[0]]}")
    kind, datas = kinds[0], [data for _, data in contents]
    where = " and ".join(names)
    if len(names) == 2 and kind in (OWN, KALIBR):
        raise DrakeTrackerError(f"{where}: one file of {_OF[kind]} contains all cameras; give one")
    if kind == OWN:
        return load_calibration(names[0]), OWN
    entries: dict[str, Entry]
    if kind == KALIBR:
        entries = read_kalibr(where, datas[0])
    elif kind == ROS:
        entries = read_ros(names, datas)
    else:
        entries = read_opencv(where, {key: value for data in datas for key, value in data.items()})
    return {name: read_camera(where, name, entry, least_size=UNKNOWN_SIZE) for name, entry in entries.items()}, kind


def _parse(path: str) -> tuple[str, dict[str, Any]]:
    """Returns (format, content) of one file."""
    text = read_calibration_text(path)
    if text.startswith("# oST"):
        raise DrakeTrackerError(f"{path}: the text file of ROS's calibrator; give the .yaml file that is beside it")
    if not is_file_storage(text):
        text = _FURTHER_MESSAGES.sub("", text)
    try:
        storage = is_file_storage(text)
        data = parse_file_storage(path, text) if storage else load_yaml(text)
    except yaml.YAMLError as error:
        if not _SECTION.search(text):
            raise yaml_error(path, error) from None
        data = None
    tests: tuple[tuple[str, Callable[[Mapping[str, Any]], bool]], ...] = (
        (OWN, lambda data: "cameras" in data),
        (KALIBR, is_camchain),
        (ROS, is_camera_info),
        (OPENCV, is_opencv),
    )
    if isinstance(data, dict):
        for kind, test in tests:
            if test(data):
                return kind, data
    has = f"; it has {', '.join(str(key)[:20] for key in list(data)[:6])}" if isinstance(data, dict) and data else ""
    raise DrakeTrackerError(
        f"{path}: not a calibration of drake-tracker (cameras), OpenCV (M1, D1, M2, D2, R, T or camera_matrix), ROS "
        f"(camera_info) or Kalibr (cam0){has}"
    )


def save_foreign(path: Path, cameras: Mapping[str, CameraModel], form: str) -> list[Path]:
    """Writes cameras as another tool does, and returns the files.

    Args:
        path: of the file; ROS gets two files for two cameras, with _left and _right before the suffix.
        cameras: one camera, or the left and the right one, of which W is the frame of the left one.
        form: one of `FORMATS` of other tools.

    Raises DrakeTrackerError when the format does not know the lens, or a file cannot be written.
    """
    if form == ROS:
        texts = ros_texts(cameras)
        paths = [path]
        if len(texts) == 2:
            paths = [path.with_name(f"{path.stem}_{name.removeprefix('camera_')}{path.suffix}") for name in texts]
        for each, text in zip(paths, texts.values()):
            write_text(each, text)
        return paths
    write_text(path, opencv_text(cameras, path.suffix) if form == OPENCV else kalibr_text(cameras))
    return [path]
