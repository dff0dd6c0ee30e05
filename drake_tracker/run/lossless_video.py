"""Grey images kept to the last bit, as they are, in Matroska: readable up to where writing stopped."""

from pathlib import Path
from typing import Any

import av
import numpy as np


class LosslessVideo:
    """A file that grows image by image, and that can be read however it ends, but for the last second.

    The images are not compressed. Sensor noise leaves a lossless code little to save: FFV1 made files of 0.6 times the
    size, and to read them took as long as all of the vision behind it. When it cannot be written, on a full disk, the
    error of the system is raised once.

    Args:
      path: file to write, ``*.mkv``. rate: images per second. size: (width, height) [px].
    """

    def __init__(self, path: Path, rate: int, size: tuple[int, int]) -> None:
        often = {"flush_packets": "1", "cluster_time_limit": "1000"}  # [ms]
        self._container = av.open(str(path), "w", format="matroska", options=often)
        self._stream = self._container.add_stream("rawvideo", rate=rate)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "gray"
        self._count = 0

    def write(self, image: np.ndarray) -> None:
        """Appends a grey image, uint8 of shape (height, width)."""
        frame = av.VideoFrame.from_ndarray(image, format="gray")
        frame.pts = self._count
        self._count += 1
        self._mux(frame)

    def close(self) -> None:
        """Ends the file. May be called again, and then does nothing."""
        if self._container is not None:
            self._mux(None)
            self._container.close()
            self._container = None

    def _mux(self, frame: Any) -> None:
        try:
            self._container.mux(self._stream.encode(frame))
        except BaseException:
            # FFmpeg must not be given more: without a header, one packet more ends the process.
            container, self._container = self._container, None
            container.close()
            raise
