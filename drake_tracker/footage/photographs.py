"""Photographs of one or two live cameras, one after the other, to calibrate them."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_bytes
from drake_tracker.footage.footage import Footage

LONGEST_WAIT = 0.5
"""Greatest difference between the times of the two images of a pair [s], where the cameras have no common trigger."""


def take_photographs(
    footage: Sequence[Footage],
    folder: Path,
    *,
    every: float,
    count: int,
    say: Callable[[str], object] = print,
) -> list[Path]:
    """Takes photographs at regular times and writes them as left01.png, right01.png, left02.png and so on.

    The first is taken after one interval.

    Args:
        footage: of one or two live cameras; it is not closed.
        folder: to write to; it is created, and must not contain such files.
        every: time from one photograph to the next [s].
        count: number of photographs of each camera.
        say: prints a line for each.

    Returns the files. Raises DrakeTrackerError when a source is not live, a file exists, or a camera stops.
    """
    for each in footage:
        if not each.live:
            raise DrakeTrackerError(f"{each.name} is not a live camera; photographs are taken with live ones")
    sides = SIDES[: len(footage)]
    _check_folder(folder, sides)
    cameras = [each.frames() for each in footage]
    files: list[Path] = []
    for number in range(1, count + 1):
        pair = _next_pair(footage, cameras, number * every, number - 1)
        apart = max(time for time, _ in pair) - min(time for time, _ in pair)
        if apart > LONGEST_WAIT:
            say(f"photograph {number}: the images of both cameras are {apart:.1f} s apart")
        for side, (_, image) in zip(sides, pair):
            files.append(folder / f"{side}{number:02d}.png")
            png = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))[1]
            write_bytes(files[-1], png.tobytes())
        say(f"photograph {number} of {count}")
    return files


def _next_pair(
    footage: Sequence[Footage], cameras: Sequence[Iterator[tuple[float, np.ndarray]]], due: float, taken: int
) -> list[tuple[float, np.ndarray]]:
    """Returns (time on the common clock [s], image) of each camera, taken when a time [s] has come.

    All cameras are read in turn until then: an image that waits in a driver would show an earlier moment.
    """
    while True:
        pair = [next(frames, None) for frames in cameras]
        shown = []
        for each, image in zip(footage, pair):
            if image is None:
                raise DrakeTrackerError(f"{each.name}: it ended after {taken} photographs; they are kept")
            shown.append(((each.epoch or 0.0) + image[0], image[1]))
        if min(stamp for stamp, _ in filter(None, pair)) >= due:
            return shown


def _check_folder(folder: Path, sides: Sequence[str]) -> None:
    """Creates the folder. Raises DrakeTrackerError when photographs of an earlier time would be mixed with new ones."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DrakeTrackerError(f"{folder}: cannot be created: {error.strerror}") from None
    old = sorted(file.name for side in sides for file in folder.glob(f"{side}*.png"))
    if old:
        raise DrakeTrackerError(f"{folder}: contains {old[0]} already; name a new folder")
