"""The boundary around third-party decoders: any error becomes one line, and no image is larger than a limit."""

import contextlib
import io
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import imagesize
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.regular_file import open_regular

LARGEST_IMAGE = 100_000_000
"""Largest number of pixels of an image; a decoder would take 0.3 GB for it."""
_SILENT = 0
"""Level of OpenCV's log at which it prints nothing."""
_FLIPS = {2: (False, True, False), 3: (False, True, True), 4: (False, False, True), 5: (True, False, False),
          6: (True, True, False), 7: (True, True, True), 8: (True, False, True)}  # fmt: skip
"""{EXIF orientation: transposed, columns reversed, rows reversed}; 1 leaves an image as it is."""


@contextlib.contextmanager
def decoding(name: object, what: str = "this image cannot be read") -> Iterator[None]:
    """A context for calls of a decoder. Any exception in it is raised as a DrakeTrackerError of one line.

    Args:
        name: of the file, and of the image in it.
        what: what the exception means, for the line.
    """
    try:
        yield
    except DrakeTrackerError:
        raise
    except MemoryError:
        raise DrakeTrackerError(f"{name}: {what}: there is not enough memory") from None
    except Exception as error:
        raise DrakeTrackerError(f"{name}: {what}: {reason(error)}") from None


def reason(error: BaseException) -> str:
    """Returns the reason for an error of a library or of the operating system, in words on one line."""
    code = getattr(error, "errno", None)
    words = getattr(error, "strerror", None) or (
        os.strerror(code) if isinstance(code, int) and code > 0 else str(error)
    )
    return " ".join(words.split())[:200] or type(error).__name__


@contextlib.contextmanager
def quiet_opencv() -> Iterator[None]:
    """A context in which OpenCV prints no warnings: our own error message has one line."""
    log = getattr(cv2.utils, "logging", cv2)  # OpenCV 4 has these functions in its main module
    level = log.getLogLevel()
    log.setLogLevel(_SILENT)
    try:
        yield
    finally:
        log.setLogLevel(level)


class Orientation(NamedTuple):
    """A transposition followed by reflections, which together are any quarter turn with or without a mirror image.

    Attributes:
        transposed: whether rows and columns are exchanged.
        flip_x: whether the columns are then reversed.
        flip_y: whether the rows are then reversed.
    """

    transposed: bool = False
    flip_x: bool = False
    flip_y: bool = False

    def size(self, width: int, height: int) -> tuple[int, int]:
        """Returns (width, height) [px] of an image as shown, from width and height of the stored image."""
        return (height, width) if self.transposed else (width, height)

    def apply(self, image: np.ndarray) -> np.ndarray:
        """Returns an image, shape (h, w) or (h, w, 3), as it is shown."""
        if self == Orientation():
            return image
        shown = image.swapaxes(0, 1) if self.transposed else image
        return np.ascontiguousarray(shown[:: -1 if self.flip_y else 1, :: -1 if self.flip_x else 1])


def decode(data: bytes, name: object, flags: int = cv2.IMREAD_COLOR) -> np.ndarray:
    """Returns an encoded image as OpenCV reads it, without the turn that its EXIF data ask for.

    Args:
        data: content of the file.
        name: of the image, for messages.
        flags: OpenCV's: colour gives BGR (h, w, 3), grey (h, w).

    Raises DrakeTrackerError when it cannot be read, or has more than `LARGEST_IMAGE` pixels.
    """
    with decoding(name), quiet_opencv():
        header: Any = imagesize.get_info(io.BytesIO(data))
        if header.width * header.height > LARGEST_IMAGE:
            raise DrakeTrackerError(
                f"{name}: this image has {header.width} x {header.height} px; at most {LARGEST_IMAGE / 1e6:g} million "
                "pixels are read"
            )
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags | cv2.IMREAD_IGNORE_ORIENTATION) if data else None
    if image is None:
        raise DrakeTrackerError(f"{name}: this image cannot be read")
    return image


def read_file(path: str | Path) -> bytes:
    """Returns the content of a regular file. Raises DrakeTrackerError when it cannot be read."""
    with decoding(path), open_regular(path) as file:
        return file.read()


def common_orientation(files: Sequence[Path]) -> tuple[Orientation, str | None]:
    """Returns the orientation of most photographs of one camera, and one line if others have another one.

    Each photograph of a camera shows the same pixels at the same place. The orientation that a camera writes into a
    file depends on how the camera was held, and may differ between files of one set. The same one is applied to all.

    Args:
        files: the photographs.
    """
    tags = [_exif_orientation(file) for file in files]
    (most, _), *others = Counter(tags).most_common()
    line = None
    if others:
        odd = next(k for k, tag in enumerate(tags) if tag != most)
        line = (
            f"{files[odd]}: has the EXIF orientation {tags[odd]}, and most of these images have {most}, which is used "
            "for all of them"
        )
    return Orientation(*_FLIPS.get(most, ())), line


def _exif_orientation(file: Path) -> int:
    """Returns the EXIF orientation of a photograph, 1 where there is none."""
    if file.suffix.lower() not in (".jpg", ".jpeg"):
        return 1  # OpenCV turns no others
    try:
        tag = imagesize.get_info(str(file)).rotation
    except Exception:  # a damaged header; reading the image names it
        return 1
    return tag if tag in _FLIPS else 1
