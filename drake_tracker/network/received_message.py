"""Reads messages that anyone on the bus may have sent, and accepts only those that the host can use."""

from collections.abc import Sequence

import numpy as np
from drake import lcmt_drake_signal, lcmt_image, lcmt_image_array

from drake_tracker.network.cycles import LATEST_TIME
from drake_tracker.network.signal_message import decode_signal

_BYTES_PER_PIXEL = 4
"""RGBA with 8 bits."""
_OVERHEAD = 4096
"""More bytes than a message has besides its pixels; vectors are smaller than this, too."""


class NotUnderstood(Exception):
    """A message that cannot be used. Its text says why."""


def largest_message(image_size: tuple[int, int] | None) -> int:
    """Returns the size of the largest message of a channel [bytes].

    Args:
        image_size: (width, height) of the images on the channel [px]; None for a channel of vectors.
    """
    return _OVERHEAD if image_size is None else image_size[0] * image_size[1] * _BYTES_PER_PIXEL + _OVERHEAD


def read_vector(data: bytes, fields: Sequence[str]) -> tuple[float, np.ndarray]:
    """Returns the sender's time [s] and the values of an encoded `lcmt_drake_signal`.

    Args:
        data: the encoded message.
        fields: names of the expected fields.

    Raises NotUnderstood for a message of another type, with other fields, or with an impossible time.
    """
    if len(data) > largest_message(None):
        raise NotUnderstood(f"it is larger than {largest_message(None)} bytes")
    try:
        message = lcmt_drake_signal.decode(data)
    except Exception as error:  # the generated decoders raise various errors on garbage
        raise NotUnderstood("it is no lcmt_drake_signal") from error
    values = decode_signal(message, fields)
    if values is None:
        raise NotUnderstood(f"its fields are not {', '.join(fields)}")
    return _checked_time(1e-3 * message.timestamp), values


def read_image(data: bytes, size: tuple[int, int]) -> tuple[float, bytes]:
    """Returns the capture time [s] of an encoded `lcmt_image_array` with a single image, and its canonical encoding.

    Args:
        data: the encoded message.
        size: expected (width, height) [px].

    Raises NotUnderstood for a message of another type, or whose image is not the expected one.
    """
    needed = f"this scenario needs {size[0]} x {size[1]} px; start host and arm with the same scenario and settings"
    if len(data) > largest_message(size):
        raise NotUnderstood(f"it is larger than an image, and {needed}")
    try:
        message = lcmt_image_array.decode(data)
        canonical = message.encode()
    except Exception as error:  # the generated decoders raise various errors on garbage
        raise NotUnderstood("it is no lcmt_image_array") from error
    if message.num_images != 1:
        raise NotUnderstood(f"it has {message.num_images} images, not one")
    image = message.images[0]
    if (image.width, image.height) != size:
        raise NotUnderstood(f"the image has {image.width} x {image.height} px, but {needed}")
    row = size[0] * _BYTES_PER_PIXEL
    form = (image.pixel_format, image.channel_type, image.compression_method, image.row_stride, image.bigendian)
    known = (
        lcmt_image.PIXEL_FORMAT_RGBA,
        lcmt_image.CHANNEL_TYPE_UINT8,
        lcmt_image.COMPRESSION_METHOD_NOT_COMPRESSED,
        row,
        False,
    )
    if form != known or image.size != row * size[1] or len(image.data) != image.size:
        raise NotUnderstood("the image is not in rows of RGBA with 8 bits, uncompressed")
    return _checked_time(1e-6 * message.header.utime), canonical


def _checked_time(time: float) -> float:
    if not 0.0 <= time <= LATEST_TIME:
        raise NotUnderstood(f"its time, {time:g} s, is no time of a clock")
    return time
