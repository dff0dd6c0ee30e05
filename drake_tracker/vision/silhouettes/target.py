"""The choice of the target among several tracked objects, and the reason for a missing point of the target."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any, Protocol, runtime_checkable

from drake_tracker.core.errors import PartError, raised
from drake_tracker.core.messages import TrackState
from drake_tracker.vision.silhouettes.target_config import TARGETS
from drake_tracker.vision.silhouettes.track_3d import Track3D


class Reason(IntEnum):
    """Reasons for a missing point of the target; messages contain these numbers."""

    NONE = 0
    NO_OBJECT = 1
    NO_MATCH = 2
    OCCLUDED = 3
    NOT_OBSERVED = 4
    OUT_OF_VIEW = 5
    UNUSABLE_IMAGE = 6
    NOT_SELECTED = 7
    MERGED = 8


REASONS = {
    Reason.NONE: "",
    Reason.NO_OBJECT: "no object is tracked",
    Reason.NO_MATCH: "no object fits the target",
    Reason.OCCLUDED: "the arm covers the target",
    Reason.NOT_OBSERVED: "the target is not seen",
    Reason.OUT_OF_VIEW: "the target is outside of an image",
    Reason.UNUSABLE_IMAGE: "an image cannot be compared with the background",
    Reason.NOT_SELECTED: "the operator has selected no object",
    Reason.MERGED: "the target cannot be told apart from another object",
}
"""{reason: the same in words}."""


@runtime_checkable
class TargetRule(Protocol):
    """Chooses one of several objects as the target.

    A rule has no memory. `choose_target` keeps a target while its track lives, and asks the rule only when there is
    none. A custom rule is a class with these members; it need not derive from this one.
    """

    @property
    def reason(self) -> Reason:
        """Why there is no target when the rule chooses none of the tracks."""
        ...

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns one of the tracks, or None when none fits.

        Args:
            tracks: those confirmed tracks that are measured now, oldest first; one or more.
        """
        ...


def make_target_rule(target: Any) -> TargetRule:
    """Returns the rule that chooses the target.

    Args:
        target: settings of a kind in `TARGETS`, such as ``Nearest()``, or a `TargetRule`, which is returned.

    Raises DrakeTrackerError when it is neither, or when a setting cannot be used.
    """
    return target if isinstance(target, TargetRule) else TARGETS.make(target)


def choose_target(rule: TargetRule, tracks: Sequence[Track3D], current: int, selected: int = 0) -> int:
    """Returns the number of the track to follow, 0 when none fits.

    A target is kept while its track lives, unless the operator selects another one. Afterwards, the rule chooses.

    Args:
        rule: the rule that chooses.
        tracks: the confirmed tracks, oldest first.
        current: number of the present target, 0 without one.
        selected: number of the track that the operator selected; without effect unless such a track lives.

    Raises PartError when the rule raises an error or chooses something else than one of its tracks.
    """
    numbers = [track.number for track in tracks]
    if selected in numbers:
        return selected
    if current in numbers:
        return current
    seen = [track for track in tracks if track.measurement is not None]
    if not seen:
        return 0
    name = f"{type(rule).__name__}.choose"
    try:
        chosen = rule.choose(tuple(seen))
    except (Exception, SystemExit) as error:
        raise PartError(f"{name} {raised(error)}") from error
    if chosen is not None and not any(chosen is track for track in seen):
        raise PartError(f"{name} returned a {type(chosen).__name__} that is none of the tracks")
    return 0 if chosen is None else chosen.number


def reason_of(track: Track3D | None, any_tracks: bool, usable: bool, no_target: Reason = Reason.NO_MATCH) -> Reason:
    """Returns why there is no point of the target.

    Args:
        track: track of the target, None without one.
        any_tracks: whether there are confirmed tracks.
        usable: whether the images could be used.
        no_target: why none of these tracks is the target, as the rule says.
    """
    if not usable:
        return Reason.UNUSABLE_IMAGE
    if track is None:
        return no_target if any_tracks else Reason.NO_OBJECT
    if track.measurement is not None:
        return Reason.NONE
    reasons = {
        TrackState.OCCLUDED: Reason.OCCLUDED,
        TrackState.OUT_OF_VIEW: Reason.OUT_OF_VIEW,
        TrackState.MERGED: Reason.MERGED,
    }
    return reasons.get(track.state, Reason.NOT_OBSERVED)
