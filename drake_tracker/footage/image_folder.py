"""A folder of images as footage; their times are the numbers in their names, or these numbers divided by a rate."""

import glob
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.decoding import Orientation, common_orientation, decode, read_file
from drake_tracker.footage.footage import Footage

_UNITS = {13: 1e-3, 16: 1e-6, 19: 1e-9}
"""{number of digits of a time since 1970: its unit [s]}."""
SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")
_LOOKED_AT = 16
"""Number of images from which the number of bits is determined."""
_MOST_CLIPPED = 0.01
"""Share of an image's pixels that may be brighter than the number of bits allows, before a warning."""


def open_images(spec: str | Path, fps: float | None = None) -> Footage:
    """Returns the `Footage` of a folder of images, or of a pattern.

    A name that ends in a number of 13, 16 or 19 digits is the capture time in ms, us or ns; one that ends in a number
    with a decimal point (1305031102.175304.png), or is one (2.175.png), is the time in s. Such folders share a clock.
    Any other number counts the images: a missing number is a dropped image. Without numbers, or with a time of day
    (12-01-00.0333.png), the images are consecutive in the order of their names.

    Args:
        spec: folder or pattern.
        fps: images per second, for names that are not capture times.

    Raises DrakeTrackerError when there are no images, two have the same time, only some have a number, or ``fps`` is
    missing.
    """
    files = list_images(spec)
    times, epoch, counted = _stamps(spec, files, fps)
    order = np.argsort(times, kind="stable")
    files, times = [files[i] for i in order], times[order] - times.min()
    same = np.flatnonzero(np.diff(times) <= 0.0)
    if len(same):
        one, other = files[same[0]], files[same[0] + 1]
        raise DrakeTrackerError(f"{spec}: {one.name} and {other.name} have the same number")
    first = next(filter(lambda image: image is not None, map(_whole_or_none, files)), None)
    if first is None:
        read_whole(files[0])  # raises
    assert first is not None
    orientation, mixed = common_orientation(files)
    size = orientation.size(first.shape[1], first.shape[0])
    # The number of bits is that of all images: determined for each of them, the brightness would flicker.
    sample = [] if first.dtype == np.uint8 else map(_whole_or_none, files[:: -(-len(files) // _LOOKED_AT)])
    bits = max(bits_of(image) for image in (first, *sample) if image is not None)
    images = _Images(str(spec), files, times, size, bits, orientation, mixed)
    return Footage(images.name, images.size, images.frames, times, epoch, counted, warning=images.warning)


def _stamps(spec: str | Path, files: Sequence[Path], fps: float | None) -> tuple[np.ndarray, float | None, bool]:
    """Returns (times (n,) [s], epoch or None [s], whether counted) from the names of files."""
    matches = [re.search(r"([0-9]+(?:\.[0-9]+)?)$", file.stem) for file in files]
    texts = [match[1] if match else "" for match in matches]
    if any(texts) and not all(texts):
        odd = files[texts.index("")]
        raise DrakeTrackerError(f"{spec}: {odd.name} has no number and others have; select the others by a pattern")
    if all("." in text and (len(text.split(".")[0]) > 8 or text == file.stem) for text, file in zip(texts, files)):
        seconds = [int(text.split(".")[0]) for text in texts]
        fractions = np.array([float("0." + text.split(".")[1]) for text in texts])
        least = min(fraction for second, fraction in zip(seconds, fractions) if second == min(seconds))
        return np.array([second - min(seconds) for second in seconds]) + fractions, float(min(seconds)) + least, False
    lengths = {len(text) for text in texts}
    if len(lengths) == 1 and lengths <= set(_UNITS):
        unit = _UNITS[lengths.pop()]
        numbers = [int(text) for text in texts]
        return unit * np.array([number - min(numbers) for number in numbers], dtype=float), unit * min(numbers), False
    if fps is None:
        raise DrakeTrackerError(f"{spec}: the names of these images do not contain capture times; add --fps N")
    if all(text and "." not in text for text in texts):
        counts = np.array([int(text) for text in texts], dtype=float)
        return counts / fps, counts.min() / fps, True
    return np.arange(len(files)) / fps, None, False


def _whole_or_none(file: Path) -> np.ndarray | None:
    try:
        return read_whole(file)
    except DrakeTrackerError:
        return None


@dataclass
class _Images:
    """The images of a folder. One that cannot be read is left out, as if it had been dropped."""

    name: str
    files: Sequence[Path]
    times: np.ndarray
    size: tuple[int, int]
    bits: int
    orientation: Orientation
    mixed: str | None
    bad: list[str] = field(default_factory=list)
    clipped: int = 0

    def warning(self) -> str | None:
        """Returns what is wrong with the images read so far, or None."""
        lines = [self.mixed] if self.mixed else []
        if self.clipped:
            share = f"{_MOST_CLIPPED:.0%} of the pixels are above {self.bits} bits, and shown as white"
            lines.append(f"{self.name}: in {self.clipped} of {len(self.files)} images more than {share}")
        if self.bad:
            more = f" and {len(self.bad) - 1} more" if len(self.bad) > 1 else ""
            lines.append(
                f"{self.name}: {len(self.bad)} of {len(self.files)} images cannot be read: {self.bad[0]}{more}"
            )
        return "; ".join(lines) or None

    def frames(self) -> Iterator[tuple[float, np.ndarray]]:
        """Yields (time [s], RGB image)."""
        self.bad, self.clipped = [], 0
        for file, time in zip(self.files, self.times):
            try:
                whole = read_whole(file)
            except DrakeTrackerError:
                self.bad.append(file.name)
                continue
            if whole.dtype != np.uint8:
                self.clipped += bool(np.mean(whole >> self.bits > 0) > _MOST_CLIPPED)
            image = self.orientation.apply(with_8_bits(whole, self.bits))
            if image.shape[1::-1] != self.size:
                raise DrakeTrackerError(
                    f"{file} has {image.shape[1]} x {image.shape[0]} px, the images before it have "
                    f"{self.size[0]} x {self.size[1]} px"
                )
            yield float(time), cv2.cvtColor(image, cv2.COLOR_BGR2RGB)


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
        if len(files) == 1 and files[0] == path and path.suffix.lower() not in SUFFIXES:
            raise DrakeTrackerError(f"{spec}: is no photograph; name a folder of them, or a pattern such as 'a*.png'")
        nothing = f"{spec}: there is no such folder of images, and no file matches it as a pattern"
    if not files:
        raise DrakeTrackerError(nothing)
    return sorted(files, key=_natural)


def read_image(path: str | Path, flags: int = cv2.IMREAD_COLOR) -> np.ndarray:
    """Returns an image file with 8 bits, as OpenCV reads it, not turned by its EXIF data.

    Args:
        path: of the file.
        flags: OpenCV's: colour gives BGR (h, w, 3), grey (h, w).

    Raises DrakeTrackerError when it cannot be read.
    """
    image = read_whole(path, flags)
    return with_8_bits(image, bits_of(image))


def with_8_bits(image: np.ndarray, bits: int) -> np.ndarray:
    """Returns the upper eight of the bits of an image of uint8 or uint16."""
    return image if image.dtype == np.uint8 else np.minimum(image >> (bits - 8), 255).astype(np.uint8)


def read_whole(path: str | Path, flags: int = cv2.IMREAD_COLOR) -> np.ndarray:
    """Returns an image file as `read_image` does, but with all its bits: uint8 or uint16."""
    image = decode(read_file(path), path, flags | cv2.IMREAD_ANYDEPTH)
    if image.dtype not in (np.uint8, np.uint16):
        raise DrakeTrackerError(f"{path}: this image has pixels of {image.dtype}; 8 or 16 bits are needed")
    return image


def bits_of(image: np.ndarray) -> int:
    """Returns the number of bits of an image's pixels: 16, 12 (cameras that leave the upper four empty), or 8."""
    if image.dtype == np.uint8:
        return 8
    return 12 if image.max() < 4096 else 16


def _is_image(file: Path) -> bool:
    """Returns False for folders, and for hidden files that operating systems put beside images (._0001.png)."""
    return file.is_file() and not file.name.startswith(".")


def _natural(path: Path) -> list[tuple[int, str]]:
    """Returns a key that sorts left2 before left10."""
    parts = re.split("([0-9]+)", path.name)  # texts and numbers alternate
    return [(int(part), "") if k % 2 else (-1, part) for k, part in enumerate(parts)]
