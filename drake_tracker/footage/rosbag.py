"""An image topic of a ROS 2 bag in MCAP format as footage. Needs the packages of the extra ``rosbag``."""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_CODES = {
    "rgb8": None,
    "8UC3": cv2.COLOR_BGR2RGB,
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
    "mono8": cv2.COLOR_GRAY2RGB,
    "8UC1": cv2.COLOR_GRAY2RGB,
    # OpenCV names a Bayer pattern by its second row.
    "bayer_rggb8": cv2.COLOR_BayerBG2RGB,
    "bayer_bggr8": cv2.COLOR_BayerRG2RGB,
    "bayer_gbrg8": cv2.COLOR_BayerGR2RGB,
    "bayer_grbg8": cv2.COLOR_BayerGB2RGB,
}
"""{encoding: OpenCV's conversion to RGB}."""
_CHANNELS = {"rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4}
"""{encoding: channels}; the others have one."""


def open_bag(path: str | Path, topic: str | None = None) -> Footage:
    """Returns the `Footage` of an image topic of a bag.

    Image and CompressedImage of sensor_msgs are supported. Times are those of the messages' headers, which cameras
    share, or those of the recording where a header has none.

    Args:
        path: file ``.mcap``, or the folder that contains one.
        topic: image topic; None is the only one in the bag.

    Raises DrakeTrackerError when the extra is not installed, when the bag cannot be read, or when the topic is not in
    it or is ambiguous.
    """
    make_reader, factory, broken = _packages()
    file = _bag_file(path)
    try:
        with open(file, "rb") as stream:
            bag = make_reader(stream)
            summary = bag.get_summary()
            schemas = {} if summary is None else {key: schema.name for key, schema in summary.schemas.items()}
            channels = [] if summary is None else summary.channels.values()
            topics = sorted({c.topic for c in channels if schemas.get(c.schema_id) in (IMAGE, COMPRESSED)})
            chosen = _choose(path, topics, topic)
            stamps = [_stamp(m) for _, _, m in bag.iter_messages(topics=[chosen])]
    except broken as error:
        raise DrakeTrackerError(f"{path}: this bag cannot be read: {_words(error)}") from None
    if not stamps:
        raise DrakeTrackerError(f"{path}: there is no message of {chosen} in this bag")
    first = min(stamps)
    times = np.array(sorted({(stamp - first) * 1e-9 for stamp in stamps}))
    name = f"{path}:{chosen}"

    def frames() -> Iterator[tuple[float, np.ndarray]]:
        last = -1.0
        try:
            with open(file, "rb") as stream:
                bag = make_reader(stream, decoder_factories=[factory()])
                for schema, _, message, decoded in bag.iter_decoded_messages(topics=[chosen]):
                    time = (_stamp(message) - first) * 1e-9
                    if time > last:
                        last = time
                        yield time, _image(decoded, schema.name, name)
        except broken as error:
            raise DrakeTrackerError(f"{name}: this bag is damaged after {last:.2f} s: {_words(error)}") from None

    _, image = next(frames())
    return Footage(name, (image.shape[1], image.shape[0]), frames, times, first * 1e-9)


def _packages() -> tuple[Any, Any, tuple[type[Exception], ...]]:
    """Returns (make_reader, DecoderFactory, exceptions that a damaged bag raises) of the optional packages."""
    try:
        from mcap.exceptions import McapError
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        raise DrakeTrackerError(
            "reading a ROS 2 bag needs the packages mcap and mcap-ros2-support: pip install 'drake-tracker[rosbag]'"
        ) from None
    return make_reader, DecoderFactory, (McapError, OSError, ValueError, IndexError, struct.error, EOFError)


def _bag_file(path: str | Path) -> Path:
    path = Path(path)
    if not path.is_dir():
        return path
    files = sorted(path.glob("*.mcap"))
    if len(files) != 1:
        raise DrakeTrackerError(f"{path}: this folder contains {len(files)} files .mcap; name one of them")
    return files[0]


def _choose(path: str | Path, topics: Sequence[str], topic: str | None) -> str:
    if not topics:
        raise DrakeTrackerError(f"{path}: there is no topic with images in this bag")
    if topic is None and len(topics) > 1:
        raise DrakeTrackerError(f"{path}: name one of its topics after a colon: {', '.join(topics)}")
    if topic is not None and topic not in topics:
        raise DrakeTrackerError(f"{path}: there is no image topic {topic}; there are {', '.join(topics)}")
    return topic or topics[0]


def _stamp(message: Any) -> int:
    """Returns the stamp [ns] of a message's header, with which both types of image begin, or that of its recording."""
    order = "<" if message.data[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", message.data, 4)
    return int(seconds * 1_000_000_000 + nanoseconds or message.log_time)


def _image(message: Any, kind: str, name: str) -> np.ndarray:
    data = np.frombuffer(bytes(message.data), np.uint8)
    if kind == COMPRESSED:
        image = cv2.imdecode(data, cv2.IMREAD_COLOR)
        if image is None:
            raise DrakeTrackerError(f"{name}: an image ({message.format}) cannot be read")
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    if message.encoding not in _CODES:
        raise DrakeTrackerError(f"{name}: encoding {message.encoding} is not supported; {', '.join(_CODES)} are")
    channels, code = _CHANNELS.get(message.encoding, 1), _CODES[message.encoding]
    rows = data.reshape(message.height, message.step)[:, : message.width * channels]
    image = rows.reshape(message.height, message.width, channels) if channels > 1 else rows
    return np.ascontiguousarray(image) if code is None else cv2.cvtColor(np.ascontiguousarray(image), code)


def _words(error: BaseException) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
