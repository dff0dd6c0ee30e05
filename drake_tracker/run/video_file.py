"""Writes an H.264 video that browsers play, and that is complete up to the last second whenever writing stops."""

import os
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

_QUALITY = "26"
"""x264's constant rate factor: 18 looks lossless, 28 shows blocks."""


class VideoFile:
    """An MP4 file that grows frame by frame.

    While it grows it is written in fragments of one second, each playable on its own, so that nothing but the last
    second is lost even when the process is killed. `close` rewrites it as one piece, which players seek in at once.
    When it cannot be written, on a full disk, the error of the system is raised once and the fragments stay.

    Args:
      path: file to write. rate: frames per second. size: (width, height) [px], both even.
    """

    wanted = True
    """Every frame is."""

    def __init__(self, path: Path, rate: int, size: tuple[int, int]) -> None:
        self._path = Path(path)
        fragments = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "flush_packets": "1"}
        self._container: Any = av.open(str(self._path), "w", format="mp4", options=fragments)
        self._stream = self._container.add_stream(
            "libx264", rate=rate, options={"preset": "ultrafast", "crf": _QUALITY, "g": str(rate)}
        )
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        self._stream.codec_context.time_base = Fraction(1, rate)
        self._stream.thread_count = 2
        self._count = 0

    def write(self, image: np.ndarray) -> None:
        """Appends a BGR image, uint8 of shape (height, width, 3)."""
        frame = av.VideoFrame.from_ndarray(cv2.cvtColor(image, cv2.COLOR_BGR2YUV_I420), format="yuv420p")
        frame.pts = self._count
        self._count += 1
        self._mux(frame)

    def close(self) -> None:
        """Writes what is left and joins the fragments. May be called again, and then does nothing."""
        if self._container is None:
            return
        self._mux(None)
        self._container.close()
        self._container = None
        if self._count:
            _join_fragments(self._path)

    def _mux(self, frame: Any) -> None:
        try:
            self._container.mux(self._stream.encode(frame))
        except BaseException:
            # FFmpeg must not be given more: without a header, one packet more ends the process.
            container, self._container = self._container, None
            container.close()
            raise


def _join_fragments(path: Path) -> None:
    """Rewrites a fragmented MP4 as one piece with its index in front, without coding the images again."""
    whole = path.with_name(path.name + ".part")
    try:
        with (
            av.open(str(path)) as source,
            av.open(str(whole), "w", format="mp4", options={"movflags": "faststart"}) as target,
        ):
            stream = source.streams.video[0]
            copy = target.add_stream_from_template(stream)
            for packet in source.demux(stream):
                if packet.dts is not None:
                    packet.stream = copy
                    target.mux(packet)
        os.replace(whole, path)
    finally:
        whole.unlink(missing_ok=True)  # there only when the disk was full; the fragments stay
