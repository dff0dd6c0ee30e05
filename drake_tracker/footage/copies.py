"""Leaves out the copies that a conversion to a higher rate put between the images of a recording."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage

_LOOKED_AT = 90
"""Number of images that are looked at to find out whether there are copies."""
_SAME = 2
"""Largest difference of grey values between an image and its copy; a codec may change a copy by rounding."""
_STILL = 4
"""Number of equal images in a row from which on the scene is at rest; a conversion does not repeat as often."""
_LEAST_COPIES, _LEAST_SHARE = 8, 0.1
"""Least number of copies, and their share among the images in which something moves; 25 to 30 images/s has a sixth."""


def without_copies(footage: Footage) -> Footage:
    """Returns a recording without the images that are copies of the image before, if a conversion has added any.

    The remaining images are the captured ones. Their stamps are those of the first of equal images. A scene at rest
    is not a conversion, and is kept as it is.

    Args:
        footage: of one camera; a live camera is returned unchanged.
    """
    if footage.times is None or footage.rate is not None:
        return footage
    try:
        if not _is_converted(np.array(list(islice(_are_copies(footage), _LOOKED_AT)), dtype=bool)):
            return footage
        new = ~np.array(list(_are_copies(footage)), dtype=bool)
    except DrakeTrackerError:  # a damaged image, which the track reports, with what was tracked before
        return footage
    distinct = footage.only(new)
    rate = 1.0 / float(np.median(np.diff(footage.times[: len(new)][new])))
    line = f"{footage.name}: {np.sum(~new)} of {len(new)} images are copies; the camera took {rate:.3g} images/s"

    def warning() -> str:
        before = footage.warning()
        return line if before is None else f"{before}; {line}"

    return replace(distinct, warning=warning)


def _are_copies(footage: Footage) -> Iterator[bool]:
    """Yields for each image whether it is a copy of the newest image that is not."""
    newest: np.ndarray | None = None
    for _, image in footage.frames():
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        copy = newest is not None and cv2.norm(newest, grey, cv2.NORM_INF) <= _SAME
        newest = newest if copy else grey
        yield copy


def _is_converted(copies: np.ndarray) -> bool:
    """Returns whether the copies, booleans (n,), are those of a conversion to a higher rate."""
    repeats = np.diff(np.flatnonzero(~copies))  # how often each image is shown
    repeats = repeats[repeats < _STILL]
    added = int((repeats - 1).sum())
    return added >= _LEAST_COPIES and added >= _LEAST_SHARE * (added + len(repeats))
