"""Writes images without loss to a Matroska file, which is readable up to the instant at which writing stopped."""

from pathlib import Path

import av
import numpy as np

from drake_tracker.footage.encoded_video import EncodedVideo


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
