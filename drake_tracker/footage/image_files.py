"""Which files a folder of images, or a pattern, means, and in which order."""

import glob
import re
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")


def list_images(spec):
    """Returns the image files (`Path`) that a folder holds or a pattern such as ``'shots/left*.jpg'`` means.

    They come in the order of the numbers in their names. Raises DrakeTrackerError when there is none.
    """
    path = Path(spec)
    if path.is_dir():
        files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and _is_image(file)]
        nothing = f"{spec}: there are no images ({', '.join(SUFFIXES)}) in this folder"
    else:
        files = [Path(file) for file in glob.glob(str(spec)) if _is_image(Path(file))]
        nothing = f"{spec}: there is no such folder of images, and no file that fits it as a pattern"
    if not files:
        raise DrakeTrackerError(nothing)
    return sorted(files, key=_natural)


def read_image(path, flags=cv2.IMREAD_COLOR, bits=None):
    """Returns an image file as OpenCV reads it, BGR (h, w, 3) or, as ``flags`` say, grey (h, w), uint8.

    ``bits``: that the pixels have; None: as many as those of this image (`bits_of`). Raises DrakeTrackerError when it
    cannot be read.
    """
    image = read_whole(path, flags)
    if image.dtype == np.uint8:
        return image
    return np.minimum(image >> ((bits or bits_of(image)) - 8), 255).astype(np.uint8)


def read_whole(path, flags=cv2.IMREAD_COLOR):
    """Returns an image file likewise, with all its bits: uint8 or uint16."""
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


def bits_of(image):
    """Returns how many bits the pixels of an image have: 16, 12 (of cameras that leave the upper four empty), or 8."""
    if image.dtype == np.uint8:
        return 8
    return 12 if image.max() < 4096 else 16


class quiet_opencv:
    """Within it OpenCV prints no warnings of its own: what goes wrong is said in one line."""

    def __enter__(self):
        self._level = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

    def __exit__(self, *_):
        cv2.utils.logging.setLogLevel(self._level)


def _is_image(file):
    """False for folders, and for the files that systems hide beside images (._0001.png)."""
    return file.is_file() and not file.name.startswith(".")


def _natural(path):
    """Sorts left2 before left10."""
    parts = re.split("([0-9]+)", path.name)  # texts and numbers by turns
    return [(int(part), "") if k % 2 else (-1, part) for k, part in enumerate(parts)]
