"""An image topic of a ROS 2 bag as footage."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.bag_storage import find_storage
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.ros_image import COMPRESSED, IMAGE, bits_of_message, read_ros_image, read_stamp


def open_bag(path: str | Path, topic: str | None = None) -> Footage:
    """Returns the `Footage` of an image topic of a bag.

    Image and CompressedImage of sensor_msgs are supported. Times are those of the messages' headers, which cameras
    share, or those of the recording where a header has none.

    Args:
        path: file ``.mcap`` or ``.db3``, or the folder that contains them.
        topic: image topic; None is the only one in the bag.

    Raises DrakeTrackerError when the extra is not installed, when the bag cannot be read, or when the topic is not in
    it or is ambiguous.
    """
    storage = find_storage(path)
    if not Path(path).exists():
        raise DrakeTrackerError(f"{path}: there is no such file or folder")
    try:
        kinds = {name: kind for name, kind in storage.topics().items() if kind in (IMAGE, COMPRESSED)}
        chosen = _choose(path, sorted(kinds), topic)
        kind = kinds[chosen]
        stamps: list[int] = []
        bits: int | None = None
        for recorded, message in storage.messages(chosen):
            if not stamps:
                bits = bits_of_message(
                    message, kind
                )  # of all images: determined for each, the brightness would flicker
            stamps.append(read_stamp(message) or recorded)
    except storage.broken as error:
        raise DrakeTrackerError(f"{path}: this bag cannot be read: {_words(error)}") from None
    if not stamps:
        raise DrakeTrackerError(f"{path}: there is no message of {chosen} in this bag")
    first = min(stamps)
    times = np.array(sorted({(stamp - first) * 1e-9 for stamp in stamps}))
    name = f"{path}:{chosen}"

    def frames() -> Iterator[tuple[float, np.ndarray]]:
        last = -1.0
        size: tuple[int, ...] = ()
        try:
            for recorded, message in storage.messages(chosen):
                time = ((read_stamp(message) or recorded) - first) * 1e-9
                if time > last:
                    last = time
                    image = read_ros_image(message, kind, name, bits)
                    size = size or image.shape[1::-1]
                    if image.shape[1::-1] != size:
                        raise DrakeTrackerError(f"{name}: the size of the images changes after {time:.2f} s")
                    yield time, image
        except storage.broken as error:
            raise DrakeTrackerError(f"{name}: this bag is damaged after {last:.2f} s: {_words(error)}") from None

    _, image = next(frames())
    return Footage(name, (image.shape[1], image.shape[0]), frames, times, first * 1e-9)


def _choose(path: str | Path, topics: Sequence[str], topic: str | None) -> str:
    if not topics:
        raise DrakeTrackerError(f"{path}: there is no topic with images in this bag")
    if topic is None and len(topics) > 1:
        raise DrakeTrackerError(f"{path}: name one of its topics after a colon: {', '.join(topics)}")
    if topic is not None and topic not in topics:
        raise DrakeTrackerError(f"{path}: there is no image topic {topic}; there are {', '.join(topics)}")
    return topic or topics[0]


def _words(error: BaseException) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
