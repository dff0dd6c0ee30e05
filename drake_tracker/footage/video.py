"""A video file as footage; the times of its frames are those of the container."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage


def open_video(path: str | Path, fps: float | None = None) -> Footage:
    """Returns the `Footage` of a video file.

    Args:
        path: of the file.
        fps: frames per second; replaces the container's times, and is needed for a file without times.

    Raises DrakeTrackerError, one line, when the file cannot be read, or contains no video or no times.
    """
    try:
        with av.open(str(path)) as container:
            stream = _video_stream(container, path)
            size = (stream.codec_context.width, stream.codec_context.height)
            ticks: list[Any] = [packet.pts for packet in container.demux(stream) if packet.size]
            base = stream.time_base
    except (av.error.FFmpegError, OSError) as error:
        raise DrakeTrackerError(f"{path}: this video cannot be read: {reason(error)}") from None
    if not ticks or not all(size):
        raise DrakeTrackerError(f"{path}: there is no image in this video")
    if fps is not None:
        times, first = np.arange(len(ticks)) / fps, None
    elif None in ticks:
        raise DrakeTrackerError(f"{path}: this video does not contain the times of its frames; add --fps N")
    else:
        ticks = sorted(set(ticks))
        first = ticks[0]
        times = np.array([float((tick - first) * base) for tick in ticks])
    return Footage(str(path), size, lambda: _frames(path, size, first, fps), times)


def reason(error: BaseException) -> str:
    """Returns the reason for an error of FFmpeg or of the operating system, in words."""
    code = getattr(error, "errno", None)
    return getattr(error, "strerror", None) or (os.strerror(code) if code else str(error))


def _frames(
    path: str | Path, size: tuple[int, int], first: Any, fps: float | None
) -> Iterator[tuple[float, np.ndarray]]:
    time = 0.0
    try:
        with av.open(str(path)) as container:
            stream = _video_stream(container, path)
            stream.thread_type = "AUTO"
            for index, frame in enumerate(container.decode(stream)):
                if (frame.width, frame.height) != size:
                    raise DrakeTrackerError(f"{path}: the size of the images changes after {time:.2f} s")
                if fps is not None:
                    time = index / fps
                elif frame.pts is not None:
                    time = float((frame.pts - first) * frame.time_base)
                yield time, _rgb(frame)
    except (av.error.FFmpegError, OSError) as error:
        raise DrakeTrackerError(f"{path}: this video is damaged after {time:.2f} s: {reason(error)}") from None


def _rgb(frame: Any) -> np.ndarray:
    """Returns the RGB image of a frame. Grey values are kept to the last bit, which FFmpeg does not guarantee."""
    if frame.format.name == "gray":
        return cv2.cvtColor(frame.to_ndarray(), cv2.COLOR_GRAY2RGB)
    return frame.to_ndarray(format="rgb24")


def _video_stream(container: Any, path: str | Path) -> Any:
    if not container.streams.video:
        raise DrakeTrackerError(f"{path}: there is no video in this file")
    return container.streams.video[0]
