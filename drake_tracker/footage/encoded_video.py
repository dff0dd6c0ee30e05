"""The file into which a stream of images is encoded, and what happens to it when writing fails."""

from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

from drake_tracker.core.files.atomic_file import unwritable


class EncodedVideo:
    """A container file with one stream of images.

    Attributes:
        stream: the stream of PyAV; its settings may be changed before the first image.

    Args:
        path: file to write.
        container: name of FFmpeg's format.
        container_options: options of the format.
        codec: name of FFmpeg's codec.
        rate: number of images per second.
        size: (width, height) of the images [px].
        codec_options: options of the codec.

    Raises DrakeTrackerError when writing fails, for example on a full disk; after that, nothing more is written.
    """

    def __init__(
        self,
        path: Path,
        container: str,
        container_options: dict[str, str],
        codec: str,
        rate: int | Fraction,
        size: tuple[int, int],
        codec_options: dict[str, str] | None = None,
    ) -> None:
        self._path = Path(path)
        self._container: Any = av.open(str(path), "w", format=container, options=container_options)
        self.stream = self._container.add_stream(codec, rate=rate, options=codec_options or {})
        self.stream.width, self.stream.height = size
        self.count = 0

    def append(self, frame: av.VideoFrame) -> None:
        """Appends an image. Raises DrakeTrackerError when it cannot be written."""
        frame.pts = self.count
        self.count += 1
        self._mux(frame)

    def close(self) -> bool:
        """Completes the file, and returns whether it was open. A second call does nothing."""
        if self._container is None:
            return False
        self._mux(None)
        container, self._container = self._container, None
        try:
            container.close()
        except OSError as error:
            raise unwritable(self._path, error) from None
        return True

    def _mux(self, frame: av.VideoFrame | None) -> None:
        if self._container is None:
            return
        try:
            self._container.mux(self.stream.encode(frame))
        except BaseException as error:
            # Close at once: without a header, FFmpeg crashes on the next packet.
            container, self._container = self._container, None
            with suppress(OSError):
                container.close()
            if isinstance(error, OSError):
                raise unwritable(self._path, error) from None
            raise


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
        codec = "ffv1" if compressed else "rawvideo"
        self._video = EncodedVideo(path, "matroska", often, codec, rate, size)
        self._format = "rgba" if colour else "gray"  # of the formats with colour, raw Matroska has this one only
        self._video.stream.pix_fmt = self._pixels = "bgr0" if compressed else self._format
        if compressed:
            self._video.stream.codec_context.thread_type = "SLICE"  # threads by image would hold back the newest images

    def write(self, image: np.ndarray) -> None:
        """Appends an image: uint8 of shape (height, width), or (height, width, 4) with red, green, blue and alpha.

        Raises DrakeTrackerError when it cannot be written.
        """
        frame = av.VideoFrame.from_ndarray(image, format=self._format)
        if self._pixels != self._format:
            frame = frame.reformat(format=self._pixels)
        self._video.append(frame)

    def close(self) -> None:
        """Completes the file. A second call does nothing."""
        self._video.close()
