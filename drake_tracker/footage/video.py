"""A video file as footage; the container gives the times of the frames."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from av.video.reformatter import VideoReformatter

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.decoding import LARGEST_IMAGE, Orientation, decoding
from drake_tracker.footage.footage import Footage

_MOST_DECLARED = 100
"""Largest ratio of declared images to images in a file; beyond this ratio, the declared number is damaged."""


class FrameTimes:
    """Gives each decoded frame its time, as a whole number of the stream's ticks.

    A decoder delivers frames in the order in which they are shown. The time of a frame is its own where that is
    possible. Otherwise, and for all frames of a stream with decode times only, the time is the next of all sorted
    times. A container such as AVI stamps frames in decoding order. B-frames are decoded after frames that are shown
    later, so that their times would run backwards.

    Args:
        ticks: times of all packets, in the order of the file.
        reordered: whether frames are not decoded in the order in which they are shown.
    """

    def __init__(self, ticks: Sequence[int], reordered: bool) -> None:
        self.ticks = sorted(set(ticks))
        self._in_order = reordered and all(one < other for one, other in zip(ticks, ticks[1:]))
        self.restart()

    def restart(self) -> None:
        """Begins again with the first frame."""
        self._last: int | None = None

    def next(self, own: int | None) -> int:
        """Returns the time of the next frame.

        Args:
            own: its time according to the decoder; None where it has none.
        """
        last = self._last
        if self._in_order or own is None or (last is not None and own <= last):
            after = 0 if last is None else bisect_right(self.ticks, last)
            own = self.ticks[after] if after < len(self.ticks) else (self.ticks[-1] if last is None else last + 1)
        self._last = own
        return own


def open_video(path: str | Path, fps: float | None = None) -> Footage:
    """Returns the `Footage` of a video file, upright as a player would show it.

    A damaged or truncated file gives the images that can be decoded, and a warning.

    Args:
        path: of the file.
        fps: frames per second; replaces the container's times, and is needed for a file without times.

    Raises DrakeTrackerError, one line, when the file cannot be read, or contains no video or no times.
    """
    ticks: list[Any] = []
    with decoding(path, "this video cannot be read"):
        with av.open(str(path)) as container:
            stream = _video_stream(container, path)
            stored = (stream.codec_context.width, stream.codec_context.height)
            if stored[0] * stored[1] > LARGEST_IMAGE:
                raise DrakeTrackerError(
                    f"{path}: this video has {stored[0]} x {stored[1]} px; at most {LARGEST_IMAGE / 1e6:g} million "
                    "pixels are read"
                )
            base, reordered = stream.time_base, bool(stream.codec_context.has_b_frames)
            for packet in _packets(container, stream):
                if not packet.is_discard:
                    ticks.append(packet.dts if packet.pts is None else packet.pts)
            missing = _missing_at_end(container, stream, ticks) if ticks else 0
        orientation = _orientation(path)
    if not ticks or not all(stored):
        raise DrakeTrackerError(f"{path}: there is no image in this video")
    if fps is None and None in ticks:
        raise DrakeTrackerError(f"{path}: this video does not contain the times of its frames; add --fps N")
    video = _Video(path, stored, orientation, len(ticks) + missing)
    if fps is not None:
        times = np.arange(len(ticks)) / fps
        return Footage(str(path), video.size, lambda: video.frames(fps), times, warning=video.warning)
    clock = FrameTimes(ticks, reordered)
    times = np.array([float((tick - clock.ticks[0]) * base) for tick in clock.ticks])
    return Footage(str(path), video.size, lambda: video.frames(clock, base), times, warning=video.warning)


class _Video:
    """The images of a video file.

    Attributes:
        size: (width, height) of the upright images [px].
    """

    def __init__(self, path: str | Path, stored: tuple[int, int], orientation: Orientation, declared: int) -> None:
        self._path, self._stored, self._orientation, self._declared = path, stored, orientation, declared
        self.size = orientation.size(*stored)
        self._good = 0
        self._ended = False
        self._bad = 0

    def warning(self) -> str | None:
        """Returns the read errors so far, or None."""
        missing = self._declared - self._good if self._ended else self._bad
        if missing <= 0:
            return None
        return f"{self._path}: the file is damaged or truncated: {missing} of {self._declared} images could not be read"

    def frames(self, clock: FrameTimes | float, base: Any = None) -> Iterator[tuple[float, np.ndarray]]:
        """Yields (time [s], RGB image).

        Args:
            clock: times of the frames, or frames per second.
            base: unit of the times [s].
        """
        self._good, self._bad, self._ended = 0, 0, False
        if isinstance(clock, FrameTimes):
            clock.restart()
        with decoding(self._path, "this video cannot be read any more"), av.open(str(self._path)) as container:
            stream = _video_stream(container, self._path)
            stream.thread_type = "AUTO"
            converter = VideoReformatter()
            for index, frame in enumerate(self._decode(container, stream)):
                if isinstance(clock, FrameTimes):
                    time = float((clock.next(frame.pts) - clock.ticks[0]) * base)
                else:
                    time = index / clock
                if frame.is_corrupt:
                    self._bad += 1
                    continue
                if (frame.width, frame.height) != self._stored:
                    raise DrakeTrackerError(f"{self._path}: the size of the images changes after {time:.2f} s")
                self._good += 1
                yield time, self._orientation.apply(_rgb(frame, converter))
            self._ended = True

    def _decode(self, container: Any, stream: Any) -> Iterator[Any]:
        """Yields the frames that can be decoded."""
        for packet in _packets(container, stream, flush=True):
            try:
                yield from stream.codec_context.decode(packet)
            except av.error.InvalidDataError:
                self._bad += 1


def _packets(container: Any, stream: Any, flush: bool = False) -> Iterator[Any]:
    """Yields the packets of a stream up to the end or to the first that cannot be read, and None at last to flush."""
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets, None)
        except av.error.FFmpegError:
            break
        if packet is None:
            break
        if packet.size:
            yield packet
    if flush:
        yield None


def _missing_at_end(container: Any, stream: Any, ticks: list[Any]) -> int:
    """Returns the number of declared images that are missing in a file."""
    if "mp4" in container.format.name:
        declared = len(stream.index_entries)  # an edit list may leave out some of ``stream.frames``
    else:
        declared = stream.frames
    if 0 < declared < _MOST_DECLARED * len(ticks):
        return max(0, declared - len(ticks))
    known = sorted({tick for tick in ticks if tick is not None})
    if stream.duration is not None or len(container.streams) > 1 or not container.duration or len(known) < 2:
        return 0
    period = float(np.median(np.diff(known))) * stream.time_base
    end = known[-1] * stream.time_base + period
    return max(0, int((container.duration / av.time_base - end) / period + 0.25))


def _orientation(path: str | Path) -> Orientation:
    """Returns the `Orientation` of a video, which is attached to its frames."""
    with av.open(str(path)) as container:
        stream = _video_stream(container, path)
        for packet in _packets(container, stream, flush=True):
            try:
                for frame in stream.codec_context.decode(packet):
                    return _orientation_of(frame)
            except av.error.InvalidDataError:
                continue
    return Orientation()


def _orientation_of(frame: Any) -> Orientation:
    """Returns the `Orientation` of a frame."""
    try:
        for data in frame.side_data.keys():  # noqa: SIM118 - iterating gives the same, but is not typed
            if data.type.name == "DISPLAYMATRIX":
                return read_orientation(memoryview(data))
    except ValueError:  # PyAV knows no name for one of the kinds of data, such as EXIF
        c, s = (round(f(np.deg2rad(frame.rotation))) for f in (np.cos, np.sin))
        return read_orientation(np.array([c, -s, 0, s, c], np.int32).tobytes())
    return Orientation()


def _rgb(frame: Any, converter: VideoReformatter) -> np.ndarray:
    """Returns the RGB image of a frame. Grey values are kept to the last bit, which FFmpeg does not guarantee.

    Without a separate converter, PyAV would start threads for each frame.
    """
    if frame.format.name == "gray":
        return cv2.cvtColor(frame.to_ndarray(), cv2.COLOR_GRAY2RGB)
    return converter.reformat(frame, format="rgb24", threads=1).to_ndarray()


def _video_stream(container: Any, path: str | Path) -> Any:
    if not container.streams.video:
        raise DrakeTrackerError(f"{path}: there is no video in this file")
    return container.streams.video[0]


def read_orientation(matrix: bytes | memoryview) -> Orientation:
    """Returns the `Orientation` of a display matrix.

    The matrix has nine numbers a b u, c d v, x y w as in ISO/IEC 14496-12, 8.3.2: a pixel at (p, q) is shown at
    (a p + c q + x, b p + d q + y). Turns other than quarter turns are taken as the nearest quarter turn.

    Args:
        matrix: 36 bytes, int32 in the order of this machine.
    """
    a, b, _, c, d = np.frombuffer(matrix, np.int32, 5).tolist()
    if abs(a) + abs(d) >= abs(b) + abs(c):
        return Orientation(False, a < 0, d < 0)
    return Orientation(True, c < 0, b < 0)
