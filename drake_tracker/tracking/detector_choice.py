"""Detector settings that suit the recording: those that the user left empty."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.footage.footage import Footage
from drake_tracker.tracking.first_look import FirstLook, take_a_look
from drake_tracker.vision.config import FrameDifference, NormalFlow

_NORMAL_FLOW_SPAN = 2 * VISION_PERIOD
"""Time [s] between the two images that normal flow compares, as with the simulated cameras."""


def can_suit(settings: Any) -> bool:
    """Returns whether something of a detector's settings was left open.

    Args:
        settings: of a detector.
    """
    if isinstance(settings, NormalFlow):
        return settings.preset == "scaled" and None in (settings.stride, settings.join_distance)
    return bool(settings == FrameDifference())


def suited(
    settings: Any,
    footage: Sequence[Footage],
    period: float,
    windows: Sequence[np.ndarray | None],
    follow: Sequence[tuple[float, float] | None],
) -> tuple[Any, list[FirstLook | None]]:
    """Returns (the settings with stride and join distance that suit the recordings, what was found in each).

    What the user has set stays as it is. Live cameras, and recordings in which nothing moves alone, get a stride that
    spans the same time as with the simulated cameras, and the usual join distance.

    Args:
        settings: of a detector, see `can_suit`.
        footage: of one or two cameras.
        period: of the images [s].
        windows: for each camera uint8 (h, w), 0 where motion does not count, or None.
        follow: for each camera the pixel (u, v) of the object to follow in the first image, or None.
    """
    usual = settings
    if isinstance(settings, NormalFlow):
        usual = replace(settings, stride=settings.stride or int(np.clip(round(_NORMAL_FLOW_SPAN / period), 1, 4)))
    if settings.centroid != "hull":
        return usual, []
    is_fixed = isinstance(settings, NormalFlow) and settings.stride is not None

    def look_at(each: Footage, window: np.ndarray | None, pixel: tuple[float, float] | None) -> FirstLook | None:
        if each.times is None:
            return None
        count = len(each.times)
        return take_a_look(each.frames, count, usual, period, window, pixel, fixed_stride=is_fixed)

    with ThreadPoolExecutor() as pool:  # both cameras at the same time
        looks = list(pool.map(look_at, footage, windows, follow))
    known = [look for look in looks if look is not None]
    if not known:
        return usual, looks
    stride, join_distance = min(look.stride for look in known), max(look.join_distance for look in known)
    if isinstance(settings, NormalFlow):
        return replace(
            usual, stride=settings.stride or stride, join_distance=settings.join_distance or join_distance
        ), looks
    return replace(usual, stride=stride, join_distance=join_distance), looks
