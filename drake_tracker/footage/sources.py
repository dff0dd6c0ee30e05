"""Opens the footage that the user names: a camera number, a folder, a pattern, a bag or a video file."""

import filecmp
import os
import re
from pathlib import Path

import cv2

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.bag_storage import is_bag
from drake_tracker.footage.decoding import decoding, quiet_opencv
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.image_folder import SUFFIXES, open_images
from drake_tracker.footage.live_camera import open_camera
from drake_tracker.footage.played_camera import PREFIX, Start, open_played
from drake_tracker.footage.recording import is_recording, open_recording
from drake_tracker.footage.rosbag import open_bag
from drake_tracker.footage.video import open_video

_CAMERA = re.compile("0|[1-9][0-9]{0,3}")
"""Number of a camera, without leading zeros."""


def is_same_source(one: str, other: str) -> bool:
    """Returns whether two sources are the same, or two files with the same content."""
    if one == other:
        return True
    try:
        if os.path.samefile(one, other):
            return True
        return Path(one).is_file() and Path(other).is_file() and filecmp.cmp(one, other, shallow=False)
    except (OSError, ValueError):  # a camera, a pattern or a topic
        return False


def is_live(spec: str) -> bool:
    """Returns whether a source is a camera, or a recording that is played as if it were one."""
    return _CAMERA.fullmatch(spec) is not None or spec.startswith(PREFIX)


def open_footage(spec: str, fps: float | None = None, start: Start | None = None) -> Footage:
    """Returns the `Footage` of a source.

    Args:
        spec: "0" (a camera), a folder of images or a pattern such as 'shots/left*.png', BAG or BAG:/topic (a ROS 2
            bag: a file .mcap or .db3, or its folder), a video file, a recording of a live camera, or play:SOURCE, which
            plays a recording at its own pace as if it were a camera.
        fps: images per second, for a source without capture times; replaces those of a video file.
        start: of recordings that are played together.

    Raises DrakeTrackerError, one line, when it cannot be read.
    """
    if not spec.strip():
        raise DrakeTrackerError("the name of a source is empty")
    if _CAMERA.fullmatch(spec):
        try:
            return open_camera(spec, fps)
        except DrakeTrackerError as error:
            hint = f"; write ./{spec} for what is named so in this folder" if Path(spec).exists() else ""
            raise DrakeTrackerError(f"{error}{hint}") from None
    if spec.startswith(PREFIX):
        recording = spec.removeprefix(PREFIX)
        if not recording:
            raise DrakeTrackerError(f"{spec}: there is no such file; name a recording after the colon")
        footage = open_footage(recording, fps)
        if footage.live:
            footage.close()
            raise DrakeTrackerError(f"{spec}: this is a live camera already")
        return open_played(footage, spec, start)
    if is_recording(spec) and fps is None:
        return open_recording(spec)
    bag, _, topic = spec.partition(":/")
    if is_bag(bag):
        return open_bag(bag, f"/{topic}" if topic else None)
    if spec.endswith((".bag", ".zstd", ".zst")):
        hint = "a bag of ROS 1; convert it with rosbags-convert" if spec.endswith(".bag") else "compressed; use zstd -d"
        raise DrakeTrackerError(f"{spec}: is {hint}")
    if Path(spec).is_dir() or (any(sign in spec for sign in "*?[") and not Path(spec).exists()):
        return open_images(spec, fps)
    if Path(spec).exists() and not Path(spec).is_file():
        raise DrakeTrackerError(f"{spec}: is neither a regular file nor a folder; name a camera by its number")
    if not Path(spec).is_file():
        raise DrakeTrackerError(f"{spec}: there is no such file, folder or camera")
    if Path(spec).suffix.lower() in SUFFIXES:
        with decoding(spec), quiet_opencv():
            pages = cv2.imcount(spec)
        what = f"is a stack of {pages} images; write each to a file" if pages > 1 else "is a single image"
        raise DrakeTrackerError(f"{spec}: {what}; name a folder of images, or a video")
    return open_video(spec, fps)
