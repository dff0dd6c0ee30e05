"""Chooses the detector settings that the user left empty, to suit the recording."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.live_camera import DEFAULT_RATE
from drake_tracker.own_cameras.first_look import FirstLook, take_a_look
from drake_tracker.vision.centroid.config import FrameDifference, NormalFlow

_NORMAL_FLOW_SPAN = 2 * VISION_PERIOD
"""Time [s] between the two images that normal flow compares, as with the simulated cameras."""
LONGEST_SIDE = 1000
"""Longer side above which images are reduced [px], if the object is large enough."""
SUFFICIENT = 30
"""Least size of the object in the reduced image [px]."""


def can_suit(settings: Any) -> bool:
    """Returns whether something of a detector's settings was left open.

    Args:
        settings: of a detector.
    """
    if isinstance(settings, NormalFlow):
        return settings.preset == "scaled" and None in (settings.stride, settings.join_distance)
    return bool(settings == FrameDifference())


class Suited(NamedTuple):
    """Settings that suit the footage.

    Attributes:
        settings: of the detector, for the reduced images.
        reduce_by: factor by which the images are reduced, see `reduced`.
        looks: what was found in each camera's images, in pixels of the full ones; None where nothing was.
    """

    settings: Any
    reduce_by: int
    looks: list[FirstLook | None]


def suited(
    settings: Any,
    footage: Sequence[Footage],
    period: float,
    windows: Sequence[np.ndarray | None],
    follow: Sequence[tuple[float, float] | None],
) -> Suited:
    """Returns what suits the recordings: stride and join distance, and the coarsest level of the image pyramid in which
    the object has `SUFFICIENT` pixels.

    Settings of the user are kept. Live cameras (but see `suited_live`), and recordings in which nothing moves alone,
    get a stride that spans the same time as with the simulated cameras, and the usual join distance. The images are
    reduced only where both are found.

    Args:
        settings: of a detector, see `can_suit`.
        footage: of one or two cameras.
        period: of the images [s].
        windows: for each camera uint8 (h, w), 0 where motion does not count, or None.
        follow: for each camera the pixel (u, v) of the object to follow in the first image, or None.
    """
    usual = _with_usual_stride(settings, period)
    if settings.centroid != "hull":
        return Suited(usual, 1, [])

    def look_at(each: Footage, window: np.ndarray | None, pixel: tuple[float, float] | None) -> FirstLook | None:
        if each.times is None:
            return None
        fixed = _has_stride(settings)
        return take_a_look(
            each.frames, len(each.times), usual, period, window, pixel, fixed_stride=fixed, reduce_by=factor
        )

    factor = _coarsest(settings, footage)
    with ThreadPoolExecutor() as pool:  # both cameras at the same time
        looks = list(pool.map(look_at, footage, windows, follow))
        while factor > _sufficient(factor, looks):
            factor //= 2
            looks = list(pool.map(look_at, footage, windows, follow))
    return Suited(_chosen(settings, usual, looks, factor), factor, looks)


def suited_live(
    settings: Any,
    footage: Sequence[Footage],
    duration: float,
    windows: Sequence[np.ndarray | None],
) -> tuple[Suited, list[Footage]]:
    """Returns (what suits the largest object, the footage from then on), see `suited`.

    Args:
        settings: of a detector, see `can_suit`.
        footage: of one or two live cameras.
        duration: for which their images are looked at [s].
        windows: see `suited`.
    """
    period = 1.0 / (footage[0].rate or DEFAULT_RATE)
    usual = _with_usual_stride(settings, period)
    if settings.centroid != "hull":
        return Suited(usual, 1, []), list(footage)

    coarsest = _coarsest(settings, footage)

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
        fixed = _has_stride(settings)
        found = take_a_look(images, count, usual, period, window, fixed_stride=fixed, reduce_by=coarsest)
        return found, each.after(last)

    with ThreadPoolExecutor() as pool:
        looks, later = zip(*pool.map(look_at, footage, windows))
    factor = _sufficient(coarsest, looks)
    return Suited(_chosen(settings, usual, looks, factor), factor, list(looks)), list(later)


def _coarsest(settings: Any, footage: Sequence[Footage]) -> int:
    """Returns the least power of two that reduces all images to `LONGEST_SIDE`.

    It is 1 where the user has set more than the stride: other settings may be lengths in pixels of the full images.
    """
    if isinstance(settings, NormalFlow) and replace(settings, stride=None) != NormalFlow():
        return 1
    factor = 1
    while max(max(each.size) for each in footage) > factor * LONGEST_SIDE:
        factor *= 2
    return factor


def _sufficient(factor: int, looks: Sequence[FirstLook | None]) -> int:
    """Returns the largest power of two up to a factor with which all objects have `SUFFICIENT` pixels, 1 if there is
    none or nothing was found."""
    while factor > 1 and not all(look is not None and look.size >= factor * SUFFICIENT for look in looks):
        factor //= 2
    return factor


def _has_stride(settings: Any) -> bool:
    """Returns whether the user has set the stride."""
    return isinstance(settings, NormalFlow) and settings.stride is not None


def _with_usual_stride(settings: Any, period: float) -> Any:
    """Returns settings with a stride that spans the same time as with the simulated cameras, if none was set."""
    if not isinstance(settings, NormalFlow):
        return settings
    return replace(settings, stride=settings.stride or int(np.clip(round(_NORMAL_FLOW_SPAN / period), 1, 4)))


def _chosen(settings: Any, usual: Any, looks: Sequence[FirstLook | None], reduce_by: int) -> Any:
    """Returns the settings that suit the object found, or the usual settings without an object."""
    known = [look for look in looks if look is not None]
    if not known:
        return usual
    stride, join_distance = min(look.stride for look in known), max(look.join_distance // reduce_by for look in known)
    if isinstance(settings, NormalFlow):
        return replace(usual, stride=settings.stride or stride, join_distance=settings.join_distance or join_distance)
    return replace(usual, stride=stride, join_distance=join_distance)
