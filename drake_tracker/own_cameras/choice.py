"""Checks options, and reads which object to follow and where: ``--roi``, ``--follow`` and ``--objects``."""

from collections.abc import Sequence

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

LEFT = "camera_left"
"""Name of a single camera in a calibration unless another one is given."""
MOST_OBJECTS = 20
"""Largest number of objects."""


def check_choice(cameras: int, roi: Sequence[str], follow: Sequence[str], objects: int) -> None:
    """Raises DrakeTrackerError when the options do not suit the number of cameras.

    Args:
        cameras: number of cameras.
        roi: values of ``--roi``.
        follow: values of ``--follow``.
        objects: value of ``--objects``.
    """
    for name, values in (("roi", roi), ("follow", follow)):
        if values and len(values) != cameras:
            raise DrakeTrackerError(f"--{name}: {len(values)} given; give one for each camera, here {cameras}")
    if not 1 <= objects <= MOST_OBJECTS:
        raise DrakeTrackerError(f"--objects {objects}: must be from 1 to {MOST_OBJECTS}")


def check_effect(
    cameras: int, calibrated: bool, plane: str | None, height: float, offset: float, max_gap: float | None, camera: str
) -> None:
    """Raises DrakeTrackerError when an option would have no effect.

    Args:
        cameras: number of cameras.
        calibrated: whether there is a calibration.
        plane: value of ``--plane``, like the following ones of their options.
        height: [m].
        offset: [s].
        max_gap: [m].
        camera: name in the calibration.
    """
    if height and plane is None:
        raise DrakeTrackerError(f"--height {height:g}: only with --plane, above which the object is that high")
    if cameras == 1 and offset:
        raise DrakeTrackerError(f"--offset {offset:g}: only with two cameras, of which the right one began later")
    if cameras == 1 and max_gap is not None:
        raise DrakeTrackerError(f"--max-gap {max_gap:g}: only with two cameras, whose rays have a gap")
    if camera != LEFT and (cameras == 2 or not calibrated):
        raise DrakeTrackerError(f"--camera {camera}: only for a single camera with --calibration FILE")


def read_pixel(text: str, size: tuple[int, int], option: str = "follow") -> tuple[float, float]:
    """Returns the pixel (u, v) of "U,V".

    Args:
        text: as the user wrote it.
        size: (width, height) of the image [px].
        option: name of the option, for messages.

    Raises DrakeTrackerError when it is not two numbers, or outside of the image.
    """
    u, v = _numbers(text, 2, option)
    if not (0.0 <= u < size[0] and 0.0 <= v < size[1]):
        raise DrakeTrackerError(f"--{option} {text}: outside of the image of {size[0]} x {size[1]} px")
    return u, v


def read_window(text: str, size: tuple[int, int]) -> np.ndarray:
    """Returns the part of the image that "X,Y,W,H" (a rectangle) or "X,Y X,Y X,Y ..." (a polygon) covers.

    The result is uint8 (h, w), 255 inside and 0 outside.

    Args:
        text: as the user wrote it [px].
        size: (width, height) of the image [px].

    Raises DrakeTrackerError when it is neither, or covers no pixel of the image.
    """
    corners = text.split()
    if len(corners) == 1:
        u, v, width, height = _numbers(text, 4, "roi")
        if width <= 0.0 or height <= 0.0:
            raise DrakeTrackerError(f"--roi {text}: width and height must be above 0")
        right, bottom = u + width - 1.0, v + height - 1.0
        points = np.array([[u, v], [right, v], [right, bottom], [u, bottom]])
    elif len(corners) >= 3:
        points = np.array([_numbers(corner, 2, "roi") for corner in corners])
    else:
        raise DrakeTrackerError(f"--roi {text}: give X,Y,W,H for a rectangle, or three corners X,Y or more")
    window = np.zeros(size[::-1], np.uint8)
    cv2.fillPoly(window, [np.rint(np.clip(points, -1e6, 1e6)).astype(np.int32)], 255)
    if not window.any():
        raise DrakeTrackerError(f"--roi {text}: outside of the image of {size[0]} x {size[1]} px")
    return window


def _numbers(text: str, count: int, option: str) -> list[float]:
    parts = text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        form = "U,V" if option == "follow" else "X,Y,W,H, or corners X,Y X,Y X,Y"
        raise DrakeTrackerError(f"--{option} {text}: must be {form} in pixels")
    return values
