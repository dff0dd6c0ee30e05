"""Writes images without loss to a Matroska file, which is readable up to the instant at which writing stopped."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import av
import numpy as np

from drake_tracker.core.atomic_file import unwritable


class LosslessVideo:
    """A file of grey or colour images without loss. If writing is interrupted, only the last second is lost.

    Rendered images are not compressed, because of sensor noise: with FFV1 the files had 0.6 times the size, and reading
    them took as long as all of the vision.

    Args:
        path: file to write, ``*.mkv``.
        rate: number of images per second.
        size: (width, height) of the images [px].
        colour: whether the images are in colour.
        compressed: whether colour images are compressed (FFV1).

    Raises DrakeTrackerError when writing fails, for example on a full disk; after that, nothing more is written.
    """

    def __init__(
        self, path: Path, rate: int, size: tuple[int, int], colour: bool = False, compressed: bool = False
    ) -> None:
        often = {"flush_packets": "1", "cluster_time_limit": "1000"}  # [ms]
        self._path = Path(path)
        self._container: Any = av.open(str(path), "w", format="matroska", options=often)
        self._stream = self._container.add_stream("ffv1" if compressed else "rawvideo", rate=rate)
        self._stream.width, self._stream.height = size
        self._format = "rgba" if colour else "gray"  # of the formats with colour, raw Matroska has this one only
        self._stream.pix_fmt = "bgr0" if compressed else self._format
        if compressed:
            self._stream.codec_context.thread_type = "SLICE"  # threads by image would hold back the newest images
        self._count = 0

    def write(self, image: np.ndarray) -> None:
        """Appends an image: uint8 of shape (height, width), or (height, width, 4) with red, green, blue and alpha.

        Raises DrakeTrackerError when it cannot be written.
        """
        frame = av.VideoFrame.from_ndarray(image, format=self._format)
        if self._stream.pix_fmt != self._format:
            frame = frame.reformat(format=self._stream.pix_fmt)
        frame.pts = self._count
        self._count += 1
        self._mux(frame)

    def close(self) -> None:
        """Completes the file. A second call does nothing."""
        if self._container is None:
            return
        self._mux(None)
        container, self._container = self._container, None
        try:
            container.close()
        except OSError as error:
            raise unwritable(self._path, error) from None

    def _mux(self, frame: Any) -> None:
        if self._container is None:
            return
        try:
            self._container.mux(self._stream.encode(frame))
        except BaseException as error:
            # Close at once: without a header, FFmpeg crashes on the next packet.
            container, self._container = self._container, None
            with suppress(OSError):
                container.close()
            if isinstance(error, OSError):
                raise unwritable(self._path, error) from None
            raise
