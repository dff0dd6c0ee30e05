"""The image files of a folder or a pattern, in order, and how they are read."""

import contextlib
import glob
import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")
_SILENT = 0
"""Level of OpenCV's log at which it prints nothing."""


def list_images(spec: str | Path) -> list[Path]:
    """Returns the image files in a folder, or those that match a pattern such as ``'shots/left*.jpg'``.

    They are in the order of the numbers in their names. Raises DrakeTrackerError when there is none.
    """
    path = Path(spec)
    if path.is_dir():
        files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and _is_image(file)]
        nothing = f"{spec}: there are no images ({', '.join(SUFFIXES)}) in this folder"
    else:
        files = [Path(file) for file in glob.glob(str(spec)) if _is_image(Path(file))]
        nothing = f"{spec}: there is no such folder of images, and no file matches it as a pattern"
    if not files:
        raise DrakeTrackerError(nothing)
    return sorted(files, key=_natural)


def read_image(path: str | Path, flags: int = cv2.IMREAD_COLOR, bits: int | None = None) -> np.ndarray:
    """Returns an image file with 8 bits, as OpenCV reads it.

    Args:
        path: of the file.
        flags: OpenCV's: colour gives BGR (h, w, 3), grey (h, w).
        bits: of the pixels in the file; None determines it from this image (`bits_of`).

    Raises DrakeTrackerError when it cannot be read.
    """
    image = read_whole(path, flags)
    if image.dtype == np.uint8:
        return image
    return np.minimum(image >> ((bits or bits_of(image)) - 8), 255).astype(np.uint8)


def read_whole(path: str | Path, flags: int = cv2.IMREAD_COLOR) -> np.ndarray:
    """Returns an image file as `read_image` does, but with all its bits: uint8 or uint16."""
    with quiet_opencv():
        try:
            image = cv2.imread(str(path), flags | cv2.IMREAD_ANYDEPTH)
        except cv2.error:
            image = None
    if image is None:
        raise DrakeTrackerError(f"{path}: this image cannot be read")
    if image.dtype not in (np.uint8, np.uint16):
        raise DrakeTrackerError(f"{path}: this image has pixels of {image.dtype}; 8 or 16 bits are needed")
    return image


def bits_of(image: np.ndarray) -> int:
    """Returns the number of bits of an image's pixels: 16, 12 (cameras that leave the upper four empty), or 8."""
    if image.dtype == np.uint8:
        return 8
    return 12 if image.max() < 4096 else 16


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


def _is_image(file: Path) -> bool:
    """Returns False for folders, and for hidden files that operating systems put beside images (._0001.png)."""
    return file.is_file() and not file.name.startswith(".")


def _natural(path: Path) -> list[tuple[int, str]]:
    """Returns a key that sorts left2 before left10."""
    parts = re.split("([0-9]+)", path.name)  # texts and numbers alternate
    return [(int(part), "") if k % 2 else (-1, part) for k, part in enumerate(parts)]
