"""Detector settings that suit the recording: those that the user left empty."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.live_camera import DEFAULT_RATE
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

    What the user has set stays as it is. Live cameras (but see `suited_live`), and recordings in which nothing moves
    alone, get a stride that spans the same time as with the simulated cameras, and the usual join distance.

    Args:
        settings: of a detector, see `can_suit`.
        footage: of one or two cameras.
        period: of the images [s].
        windows: for each camera uint8 (h, w), 0 where motion does not count, or None.
        follow: for each camera the pixel (u, v) of the object to follow in the first image, or None.
    """
    usual = _with_usual_stride(settings, period)
    if settings.centroid != "hull":
        return usual, []

    def look_at(each: Footage, window: np.ndarray | None, pixel: tuple[float, float] | None) -> FirstLook | None:
        if each.times is None:
            return None
        return take_a_look(
            each.frames, len(each.times), usual, period, window, pixel, fixed_stride=_has_stride(settings)
        )

    with ThreadPoolExecutor() as pool:  # both cameras at the same time
        looks = list(pool.map(look_at, footage, windows, follow))
    return _chosen(settings, usual, looks), looks


def suited_live(
    settings: Any,
    footage: Sequence[Footage],
    duration: float,
    windows: Sequence[np.ndarray | None],
) -> tuple[Any, list[FirstLook | None], list[Footage]]:
    """Returns (settings that suit the largest object, what was found in each, the footage from then on).

    Args:
        settings: of a detector, see `can_suit`.
        footage: of one or two live cameras.
        duration: for which their images are looked at [s].
        windows: see `suited`.
    """
    period = 1.0 / (footage[0].rate or DEFAULT_RATE)
    usual = _with_usual_stride(settings, period)
    if settings.centroid != "hull":
        return usual, [], list(footage)

    def look_at(each: Footage, window: np.ndarray | None) -> tuple[FirstLook | None, Footage]:
        last = 0.0

        def images() -> Iterator[tuple[float, np.ndarray]]:
            nonlocal last
            for time, image in each.frames():
                last = time
                yield time, image
                if time >= duration:
                    return

        count = round(duration / period)
        found = take_a_look(images, count, usual, period, window, fixed_stride=_has_stride(settings))
        return found, each.after(last)

    with ThreadPoolExecutor() as pool:
        looks, later = zip(*pool.map(look_at, footage, windows))
    return _chosen(settings, usual, looks), list(looks), list(later)


def _has_stride(settings: Any) -> bool:
    """Returns whether the user has set the stride."""
    return isinstance(settings, NormalFlow) and settings.stride is not None


def _with_usual_stride(settings: Any, period: float) -> Any:
    """Returns settings with a stride that spans the same time as with the simulated cameras, if none was set."""
    if not isinstance(settings, NormalFlow):
        return settings
    return replace(settings, stride=settings.stride or int(np.clip(round(_NORMAL_FLOW_SPAN / period), 1, 4)))


def _chosen(settings: Any, usual: Any, looks: Sequence[FirstLook | None]) -> Any:
    """Returns the settings that suit what was found: the usual ones where nothing was."""
    known = [look for look in looks if look is not None]
    if not known:
        return usual
    stride, join_distance = min(look.stride for look in known), max(look.join_distance for look in known)
    if isinstance(settings, NormalFlow):
        return replace(usual, stride=settings.stride or stride, join_distance=settings.join_distance or join_distance)
    return replace(usual, stride=stride, join_distance=join_distance)
