"""Chooses which of several tracked objects is followed."""

import colorsys
import re
from collections.abc import Sequence
from enum import IntEnum
from typing import Any

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.config import Coloured, Inside, Largest, Nearest, Selected
from drake_tracker.vision.object_track import ObjectTrack, TrackState
from drake_tracker.vision.window import check_box

COLOURLESS = 0.15
"""Saturation below which a colour has no hue."""


class Reason(IntEnum):
    """Why there is no point of the target; the numbers are those of the messages."""

    NONE = 0
    NO_OBJECT = 1
    NO_MATCH = 2
    OCCLUDED = 3
    NOT_OBSERVED = 4
    OUT_OF_VIEW = 5
    UNUSABLE_IMAGE = 6
    NOT_SELECTED = 7


REASONS = {
    Reason.NONE: "",
    Reason.NO_OBJECT: "no object is tracked",
    Reason.NO_MATCH: "no object fits the target",
    Reason.OCCLUDED: "the arm covers the target",
    Reason.NOT_OBSERVED: "the target is not seen",
    Reason.OUT_OF_VIEW: "the target is outside of an image",
    Reason.UNUSABLE_IMAGE: "an image cannot be compared with the background",
    Reason.NOT_SELECTED: "the operator has selected no object",
}
"""{reason: the same in words}."""


def check_target(settings: Any) -> None:
    """Raises DrakeTrackerError when settings of the choice of a target cannot be used.

    Args:
        settings: `First`, `Largest`, `Nearest`, `Inside`, `Coloured` or `Selected`.
    """
    check_settings(settings, "target")
    if isinstance(settings, Coloured):
        parse_colour(settings.colour)
    elif isinstance(settings, Inside):
        check_box(settings.box)
    elif isinstance(settings, Nearest) and not (np.shape(settings.point) == (3,) and np.isfinite(settings.point).all()):
        raise DrakeTrackerError(f"target: point is {settings.point!r}; it must be x, y, z in W [m]")


def choose_target(settings: Any, tracks: Sequence[ObjectTrack], current: int, selected: int = 0) -> int:
    """Returns the number of the track to follow, 0 when none fits.

    A target is kept while its track lives, unless the operator selects another one. Afterwards, the settings choose.

    Args:
        settings: `First`, `Largest`, `Nearest`, `Inside`, `Coloured` or `Selected`.
        tracks: the confirmed tracks, oldest first.
        current: number of the present target, 0 without one.
        selected: number of the track that the operator selected; without effect unless such a track lives.
    """
    if any(track.number == selected for track in tracks):
        return selected
    if any(track.number == current for track in tracks):
        return current
    if isinstance(settings, Selected):
        return 0
    seen = [track for track in tracks if track.measurement is not None]
    if isinstance(settings, Inside):
        low, high = np.asarray(settings.box)
        seen = [track for track in seen if (track.position >= low).all() and (track.position <= high).all()]
    elif isinstance(settings, Nearest):
        seen = _best(seen, [float(np.linalg.norm(each.position - settings.point)) for each in seen], settings.within)
    elif isinstance(settings, Largest):
        seen = _best(seen, [-float(np.prod(each.shape.dimensions)) for each in seen], 0.0)
    elif isinstance(settings, Coloured):
        wanted = hue(parse_colour(settings.colour))
        distances = [hue_distance(hue(each.colour), wanted) for each in seen]
        seen = _best(seen, distances, settings.tolerance)
    return seen[0].number if seen else 0


def reason_of(track: ObjectTrack | None, any_tracks: bool, usable: bool, asks: bool = False) -> Reason:
    """Returns why there is no point of the target.

    Args:
        track: track of the target, None without one.
        any_tracks: whether there are confirmed tracks.
        usable: whether the images could be used.
        asks: whether the target must be selected by the operator.
    """
    if not usable:
        return Reason.UNUSABLE_IMAGE
    if track is None:
        return (Reason.NOT_SELECTED if asks else Reason.NO_MATCH) if any_tracks else Reason.NO_OBJECT
    if track.measurement is not None:
        return Reason.NONE
    reasons = {TrackState.OCCLUDED: Reason.OCCLUDED, TrackState.OUT_OF_VIEW: Reason.OUT_OF_VIEW}
    return reasons.get(track.state, Reason.NOT_OBSERVED)


def parse_colour(text: str) -> tuple[float, float, float]:
    """Returns (red, green, blue), each 0 to 255, of a colour "#rrggbb". Raises DrakeTrackerError for any other text."""
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise DrakeTrackerError(f"target: colour is {text!r}; it must be #rrggbb, such as #d0b040")
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


def hue(colour: Sequence[float]) -> float | None:
    """Returns the hue [deg] of a colour (red, green, blue), each 0 to 255, None for one that is nearly grey."""
    angle, saturation, _ = colorsys.rgb_to_hsv(*(value / 255.0 for value in colour))
    return 360.0 * angle if saturation >= COLOURLESS else None


def hue_distance(one: float | None, other: float | None) -> float:
    """Returns the angle between two hues [deg]: 0 between two greys, 180 between a grey and a colour."""
    if one is None or other is None:
        return 0.0 if one is other else 180.0
    turn = abs(one - other) % 360.0
    return min(turn, 360.0 - turn)


def _best(tracks: Sequence[ObjectTrack], costs: Sequence[float], limit: float) -> list[ObjectTrack]:
    """Returns the track of the least cost, as a list, empty when none costs at most ``limit``."""
    if not tracks or min(costs) > limit:
        return []
    return [tracks[int(np.argmin(costs))]]
