"""Writes an H.264 video for browsers. If writing is interrupted, only the last second is lost."""

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.footage.encoded_video import EncodedVideo

_QUALITY = "26"
"""x264's constant rate factor: 18 looks lossless, 28 shows blocks."""


class VideoFile:
    """An MP4 file to which frames are appended.

    The file is written in fragments of one second, which are playable even if the process is killed. `close` rewrites
    it as one piece, in which players can seek quickly. On a full disk the fragments written so far are kept.

    Args:
        path: file to write, ``*.mp4``.
        rate: number of frames per second.
        size: (width, height) of the frames [px], both even.
        threads: number of threads that encode. One takes a fifth less time in all where both cores are busy.

    Raises DrakeTrackerError when writing fails, for example on a full disk; after that, nothing more is written.
    """

    wanted = True
    """Whether the next frame is wanted, which it always is."""

    def __init__(self, path: Path, rate: int | Fraction, size: tuple[int, int], threads: int = 2) -> None:
        self._path = Path(path)
        fragments = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "flush_packets": "1"}
        codec_options = {"preset": "ultrafast", "crf": _QUALITY, "g": str(round(rate))}
        self._video = EncodedVideo(self._path, "mp4", fragments, "libx264", rate, size, codec_options)
        stream = self._video.stream
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, rate)
        stream.thread_count = threads

    def write(self, image: np.ndarray) -> None:
        """Appends a frame. Raises DrakeTrackerError when it cannot be written.

        Args:
            image: BGR image, uint8 of shape (height, width, 3).
        """
        planes = cv2.cvtColor(image, cv2.COLOR_BGR2YUV_I420)
        self._video.append(av.VideoFrame.from_ndarray(planes, format="yuv420p"))

    def skip(self) -> None:
        """Omits a frame: the previous frame is shown for longer."""
        self._video.count += 1

    def close(self) -> None:
        """Completes the file and joins its fragments. A second call does nothing."""
        if self._video.close() and self._video.count:
            _join_fragments(self._path)


def _join_fragments(path: Path) -> None:
    """Rewrites a fragmented MP4 file as one piece with its index in front, without encoding the images again."""
    with (
        replacing(path) as whole,
        av.open(str(path)) as source,
        av.open(str(whole), "w", format="mp4", options={"movflags": "faststart"}) as target,
    ):
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        for packet in source.demux(stream):
            if packet.dts is not None:
                packet.stream = copy
                target.mux(packet)
