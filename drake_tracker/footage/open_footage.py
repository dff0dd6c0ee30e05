"""From what the user wrote to footage: a number, a folder, a pattern, a bag or a video file."""

import re
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.image_folder import open_images
from drake_tracker.footage.live_camera import open_camera
from drake_tracker.footage.rosbag import open_bag
from drake_tracker.footage.video import open_video


def open_footage(spec, fps=None):
    """Returns the `Footage` that ``spec`` means: "0" (a camera), a folder or 'a/pattern*.png' of images, BAG.mcap,
    BAG.mcap:/topic (a ROS 2 bag, or its folder), or a video file.

    ``fps``: images per second, where the source does not tell, or in place of what a video file tells. Raises
    DrakeTrackerError, one line, when it cannot be read.
    """
    if re.fullmatch("[0-9]{1,4}", spec):
        return open_camera(spec, fps)
    bag, _, topic = spec.partition(":/")
    if bag.endswith(".mcap") or (Path(bag).is_dir() and any(Path(bag).glob("*.mcap"))):
        return open_bag(bag, f"/{topic}" if topic else None)
    if Path(spec).is_dir() or (any(sign in spec for sign in "*?[") and not Path(spec).exists()):
        return open_images(spec, fps)
    if not Path(spec).is_file():
        raise DrakeTrackerError(f"{spec}: there is no such file, folder or camera")
    return open_video(spec, fps)
