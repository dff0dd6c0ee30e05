"""Groups messages, which arrive one by one and may be lost, into the cycles of one sender."""

import re
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from drake import lcmt_drake_signal, lcmt_image, lcmt_image_array

from drake_tracker.network.channels import decode_signal, sender_of

REORDERED = 6
"""Cycles by which a message may be late or early. A message farther off needs others that agree with it."""
LONGEST_GAP = 600
"""Cycles without a message (10 s) after which the sender's clock counts as restarted."""
AGREEING = 3
"""Cycles, one after the other, that must agree before the clock jumps: a single wrong time changes nothing."""
LATEST_TIME = 1e10
"""Latest time of a sender [s]: clocks that count from 1970 reach it in 2286. Later ones are too coarse as a float."""
SILENCE = 1.0
"""Wall time without a message after which a sender counts as silent [s]."""
_MOST_NAMED = 20
"""Greatest number of ignored senders that are named."""
_RUN_OF_IMAGE = re.compile(r".* run ([0-9]{1,10})")
"""The name of an image's frame, with the identifier of the run."""
_BYTES_PER_PIXEL = 4
"""RGBA with 8 bits."""
_OVERHEAD = 4096
"""More bytes than a message has besides its pixels; vectors are smaller than this, too."""


@dataclass(frozen=True)
class Cycle:
    """The messages that were sent in one cycle.

    Attributes:
        number: the sender's time divided by the period.
        messages: {channel: message}, without the channels whose message was lost.
        anew: whether the sender's clock started, or restarted, with this cycle.
    """

    number: int
    messages: dict[str, Any]
    anew: bool


class CycleCollector:
    """Collects the messages of one cycle. A cycle ends when it is complete, or when a later one begins.

    A message whose time is far from the newest cycle is set aside. Once `AGREEING` consecutive cycles without a message
    of the present clock between them have come, the collector accepts these cycles: they follow a gap, or the clock has
    restarted. A message of the present clock discards the messages set aside.

    Args:
        channels: the channels of which a cycle consists.
        period: period of the cycles [s].
    """

    def __init__(self, channels: Collection[str], period: float) -> None:
        self._channels, self._period = frozenset(channels), period
        self._open: Cycle | None = None
        self._last: int | None = None
        self._aside: list[tuple[str, int, Any]] = []

    def put(self, channel: str, time: float, message: Any) -> list[Cycle]:
        """Accepts a message. Returns the cycles that it ends, oldest first.

        Args:
            channel: the channel on which the message arrived.
            time: the sender's time [s], from 0 to `LATEST_TIME`.
            message: the message.
        """
        number = round(time / self._period)
        newest = self._newest
        if newest is None or abs(number - newest) <= REORDERED:
            self._aside = []
            return self._add(channel, number, message, newest is None)
        if self._aside and abs(number - self._aside[-1][1]) > REORDERED:
            self._aside = []
        if any(each[:2] == (channel, number) for each in self._aside):
            return []  # sent twice
        self._aside.append((channel, number, message))
        if len({each[1] for each in self._aside}) < AGREEING:
            return []
        agreed, self._aside = self._aside, []
        anew = not 0 < agreed[0][1] - newest <= LONGEST_GAP
        ended = []
        for k, each in enumerate(agreed):
            ended += self._add(*each, anew=anew and k == 0)
        return ended

    @property
    def _newest(self) -> int | None:
        return self._last if self._open is None else self._open.number

    def _add(self, channel: str, number: int, message: Any, anew: bool) -> list[Cycle]:
        """Adds a message to the open cycle, or opens one. Returns the cycles that it ends."""
        newest = self._newest
        ended = []
        if self._open is not None and (anew or number > self._open.number):
            ended.append(self._end(self._open))
        if not anew and ((newest is not None and number < newest) or number == self._last):
            return ended  # late, or sent twice
        if self._open is None:
            self._open = Cycle(number, {}, anew)
        self._open.messages[channel] = message
        if self._channels <= self._open.messages.keys():
            ended.append(self._end(self._open))
        return ended

    def _end(self, cycle: Cycle) -> Cycle:
        self._open = None
        self._last = cycle.number
        return cycle


class SenderLock:
    """Follows the first sender that is heard, until that sender is silent. Other senders are named once, and ignored.

    Args:
        kind: what the senders are, for example "arm".
        tell: called with each line of news for the user.
        clock: returns the wall time [s].

    Attributes:
        sender: identifier of the sender that is followed; None before the first message.
    """

    def __init__(self, kind: str, tell: Callable[[str], object], clock: Callable[[], float] = time.monotonic) -> None:
        self._kind, self._tell, self._clock = kind, tell, clock
        self._heard = 0.0
        self._named: set[str] = set()
        self.sender: float | None = None

    def accepts(self, sender: float) -> bool:
        """Returns whether a message is to be used.

        Args:
            sender: identifier of its sender; 0 stands for senders that name none.
        """
        now = self._clock()
        if not 0.0 <= sender <= LATEST_TIME or (
            self.sender is not None and sender != self.sender and now - self._heard <= SILENCE
        ):
            self.ignore(sender)
            return False
        self.sender, self._heard = sender, now
        return True

    def ignore(self, sender: float) -> None:
        """Names a sender whose messages are ignored, unless it was named before."""
        name = f"{sender:.0f}"
        if name not in self._named and len(self._named) < _MOST_NAMED:
            self._named.add(name)
            self._tell(f"ignoring the messages of another {self._kind} on the bus, {name}")


class NotUnderstood(Exception):
    """A message that cannot be used. Its text says why."""


def largest_message(image_size: tuple[int, int] | None) -> int:
    """Returns the size of the largest message of a channel [bytes].

    Args:
        image_size: (width, height) of the images on the channel [px]; None for a channel of vectors.
    """
    return _OVERHEAD if image_size is None else image_size[0] * image_size[1] * _BYTES_PER_PIXEL + _OVERHEAD


def read_vector(data: bytes, fields: Sequence[str]) -> tuple[float, np.ndarray, float]:
    """Returns the sender's time [s], the values, and the identifier of the run, of an encoded `lcmt_drake_signal`.

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
    return _checked_time(1e-3 * message.timestamp), values, sender_of(message)[0]


def read_image(data: bytes, size: tuple[int, int]) -> tuple[float, bytes, float]:
    """Returns (capture time [s], canonical encoding, identifier of the run) of an `lcmt_image_array` with one image.

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
    run = _RUN_OF_IMAGE.fullmatch(image.header.frame_name)
    return _checked_time(1e-6 * message.header.utime), canonical, float(run[1]) if run else 0.0


def _checked_time(time: float) -> float:
    if not 0.0 <= time <= LATEST_TIME:
        raise NotUnderstood(f"its time, {time:g} s, is no time of a clock")
    return time
