"""An image topic of a ROS 2 bag as footage."""

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.bag_storage import find_storage
from drake_tracker.footage.decoding import decode, decoding, reason
from drake_tracker.footage.footage import Footage

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_CDR_HEADER = 4
_LEAST_DIFFERENT = 0.5
"""Share of different stamps in the headers of images above which the headers give the times."""
_MOST_LISTED = 20
"""Largest number of topics in a message."""
_LONGEST_NAME = 4096
"""Largest number of bytes of a text in a message."""
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
    "mono16": cv2.COLOR_GRAY2RGB,
    "16UC1": cv2.COLOR_GRAY2RGB,
    "rgb16": None,
    "bgr16": cv2.COLOR_BGR2RGB,
    "uyvy": cv2.COLOR_YUV2RGB_UYVY,
    "yuv422": cv2.COLOR_YUV2RGB_UYVY,
    "yuyv": cv2.COLOR_YUV2RGB_YUY2,
    "yuv422_yuy2": cv2.COLOR_YUV2RGB_YUY2,
    "nv21": cv2.COLOR_YUV2RGB_NV21,
    "nv12": cv2.COLOR_YUV2RGB_NV12,
    "nv24": cv2.COLOR_YUV2RGB_NV12,  # of the image with every brightness four times, see `_image`
}
"""{encoding: OpenCV's conversion to RGB}."""
_CHANNELS = {
    "rgb8": 3,
    "bgr8": 3,
    "8UC3": 3,
    "rgba8": 4,
    "bgra8": 4,
    "rgb16": 3,
    "bgr16": 3,
    "uyvy": 2,
    "yuv422": 2,
    "yuyv": 2,
    "yuv422_yuy2": 2,
}
"""{encoding: channels}; the others have one."""
_ROWS = {"nv21": 1.5, "nv12": 1.5, "nv24": 3.0}
"""{encoding: rows of data for each row of the image}; the others have one."""


def open_bag(path: str | Path, topic: str | None = None) -> Footage:
    """Returns the `Footage` of an image topic of a bag.

    Image and CompressedImage of sensor_msgs are supported. Times come from the headers of the messages, whose clock all
    cameras share, or from the recording if a header has no time.

    Args:
        path: file ``.mcap`` or ``.db3``, or the folder that contains them.
        topic: image topic; None is the only one in the bag.

    Raises DrakeTrackerError when the extra is not installed, when the bag cannot be read, or when the topic is not in
    it or is ambiguous.
    """
    storage = find_storage(path)
    if not Path(path).exists():
        raise DrakeTrackerError(f"{path}: there is no such file or folder")
    with decoding(path, "this bag cannot be read"):
        topics = storage.topics()
    chosen = _choose(path, topics, topic)
    kind = topics[chosen]
    headers: list[int] = []
    received: list[int] = []
    bits: int | None = None
    damage: str | None = None
    try:
        for number, (recorded, message) in enumerate(storage.messages(chosen)):
            if number & (number - 1) == 0:  # a few images; a dark one does not show all of its bits
                bits = max(bits or 0, bits_of_message(message, kind) or 0) or None
            headers.append(read_stamp(message))
            received.append(recorded)
    except Exception as error:  # a damaged file can raise anything
        damage = reason(error)
        if not received:
            raise DrakeTrackerError(f"{path}: this bag cannot be read: {damage}") from None
    if not received:
        raise DrakeTrackerError(f"{path}: there is no message of {chosen} in this bag")
    has_stamps = len(set(headers)) > _LEAST_DIFFERENT * len(headers)
    stamps = [stamp or recorded for stamp, recorded in zip(headers, received)] if has_stamps else received
    first = min(stamps)
    times = np.array(sorted({(stamp - first) * 1e-9 for stamp in stamps}))
    name = f"{path}:{chosen}"

    def frames() -> Iterator[tuple[float, np.ndarray]]:
        last = -1.0
        size: tuple[int, ...] = ()
        with decoding(name, "this bag cannot be read any more"):
            for stamp, (_, message) in zip(stamps, storage.messages(chosen)):
                time = (stamp - first) * 1e-9
                if time > last:
                    last = time
                    image = read_ros_image(message, kind, name, bits)
                    size = size or image.shape[1::-1]
                    if image.shape[1::-1] != size:
                        raise DrakeTrackerError(f"{name}: the size of the images changes after {time:.2f} s")
                    yield time, image

    lines = []
    if damage:
        lines.append(f"{name}: the bag is damaged or incomplete; {len(times)} images can be read: {damage}")
    if not has_stamps and any(headers):
        lines.append(f"{name}: the stamps of the headers do not change; the times of recording are used")

    _, image = next(frames())
    return Footage(
        name, (image.shape[1], image.shape[0]), frames, times, first * 1e-9, warning=lambda: "; ".join(lines) or None
    )


def _choose(path: str | Path, topics: Mapping[str, str], topic: str | None) -> str:
    """Returns the topic to read. Raises DrakeTrackerError, one line that lists what there is."""
    images = sorted(name for name, kind in topics.items() if kind in (IMAGE, COMPRESSED))
    if not images:
        others = ", ".join(f"{name} ({kind})" for name, kind in sorted(topics.items())[:_MOST_LISTED])
        raise DrakeTrackerError(
            f"{path}: there is no topic with images in this bag ({IMAGE} or {COMPRESSED}); it has {others or 'none'}"
        )
    if topic is None and len(images) > 1:
        raise DrakeTrackerError(f"{path}: name one of its topics after a colon: {', '.join(images)}")
    if topic is not None and topic not in images:
        raise DrakeTrackerError(f"{path}: there is no image topic {topic}; there are {', '.join(images)}")
    return topic or images[0]


class _Reader:
    """Reads the fields of a message one after the other. Raises ValueError beyond its end."""

    def __init__(self, message: bytes) -> None:
        if len(message) < _CDR_HEADER:
            raise ValueError("a message is cut off")
        self._bytes = memoryview(message)
        self.order = "<" if message[1] & 1 else ">"
        self._at = _CDR_HEADER

    def number(self, kind: str) -> int:
        """Returns a whole number; ``kind`` is its code in `struct`."""
        size = struct.calcsize(kind)
        self._at += -(self._at - _CDR_HEADER) % size
        return int(struct.unpack(self.order + kind, self._take(size))[0])

    def text(self) -> str:
        """Returns a string."""
        length = self.number("I")
        if length > _LONGEST_NAME:
            raise ValueError(f"a text of {length} bytes")
        return bytes(self._take(length)).rstrip(b"\0").decode(errors="replace")

    def array(self) -> np.ndarray:
        """Returns a sequence of bytes as uint8 (n,)."""
        return np.frombuffer(self._take(self.number("I")), np.uint8)

    def _take(self, count: int) -> memoryview:
        if count > len(self._bytes) - self._at:
            raise ValueError("a message is cut off")
        self._at += count
        return self._bytes[self._at - count : self._at]


def read_stamp(message: bytes) -> int:
    """Returns the stamp of a message's header [ns], 0 where there is none. Raises ValueError when it is cut off."""
    fields = _Reader(message)
    return fields.number("i") * 1_000_000_000 + fields.number("I")


def read_ros_image(message: bytes, kind: str, name: str, bits: int | None = None) -> np.ndarray:
    """Returns the image in a message: RGB uint8 (h, w, 3).

    Args:
        message: as recorded.
        kind: `IMAGE` or `COMPRESSED`.
        name: of the source, for messages.
        bits: of the pixels with two bytes, of which the upper eight are used; None: 16.

    Raises DrakeTrackerError when its encoding is not supported, or it contradicts itself.
    """
    try:
        fields = _Reader(message)
        _ = fields.number("i"), fields.number("I"), fields.text()
        if kind == COMPRESSED:
            described = fields.text()
            coded = fields.array()
            return cv2.cvtColor(decode(coded.tobytes(), f"{name}: an image ({described})"), cv2.COLOR_BGR2RGB)
        height, width, encoding = fields.number("I"), fields.number("I"), fields.text()
        big, step, data = fields.number("B"), fields.number("I"), fields.array()
    except ValueError as error:
        raise DrakeTrackerError(f"{name}: an image is damaged: {error}") from None
    if encoding not in _CODES:
        raise DrakeTrackerError(f"{name}: encoding {encoding} is not supported; {', '.join(_CODES)} are")
    return _image(data, height, width, step, encoding, big > 0, name, bits)


def bits_of_message(message: bytes, kind: str) -> int | None:
    """Returns how many bits the pixels of an image use that have two bytes each: 12 or 16; None with one byte."""
    fields = _Reader(message)
    _ = fields.number("i"), fields.number("I"), fields.text()
    if kind == COMPRESSED:
        return None
    _, _, encoding = fields.number("I"), fields.number("I"), fields.text()
    big, _, data = fields.number("B"), fields.number("I"), fields.array()
    if "16" not in encoding:
        return None
    values = data[: data.size // 2 * 2].view(">u2" if big else "<u2")
    return 12 if values.size and values.max() < 4096 else 16


def _image(
    data: np.ndarray, height: int, width: int, step: int, encoding: str, big: bool, name: str, bits: int | None
) -> np.ndarray:
    """Returns the pixels of an Image message as RGB."""
    channels, code = _CHANNELS.get(encoding, 1), _CODES[encoding]
    deep = "16" in encoding
    rows = int(height * _ROWS.get(encoding, 1.0))
    row_bytes = width * channels * (2 if deep else 1)
    odd = (channels == 2 and width % 2) or (_ROWS.get(encoding) == 1.5 and (width % 2 or height % 2))
    if not height or not width or step < row_bytes or rows * step > data.size or odd:
        raise DrakeTrackerError(
            f"{name}: an image is damaged: {width} x {height} px of {encoding}, {step} bytes in a row, "
            f"{data.size} in all"
        )
    pixels = np.ascontiguousarray(data[: rows * step].reshape(rows, step)[:, :row_bytes])
    if deep:
        values = pixels.view(">u2" if big else "<u2")
        pixels = np.minimum(values >> ((bits or 16) - 8), 255).astype(np.uint8)
    if channels > 1:
        pixels = pixels.reshape(rows, width, channels)
    if encoding == "nv24":
        bright = pixels[:height].repeat(2, axis=0).repeat(2, axis=1)
        colours = pixels[height:].reshape(height, 2 * width)
        return np.ascontiguousarray(cv2.cvtColor(np.vstack([bright, colours]), cv2.COLOR_YUV2RGB_NV12)[::2, ::2])
    return pixels if code is None else cv2.cvtColor(pixels, code)
