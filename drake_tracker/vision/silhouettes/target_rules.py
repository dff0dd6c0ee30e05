"""The rules that choose the target, one for each kind of settings in `target_config.py`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_tracker.core.colour import COLOUR_RULE, hue, hue_distance, is_colour, rgb
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.region_of_interest import check_box
from drake_tracker.vision.silhouettes.target import Reason
from drake_tracker.vision.silhouettes.target_config import Coloured, Inside, Nearest
from drake_tracker.vision.silhouettes.track_3d import Track3D


class _Rule:
    """The common part of the rules.

    Args:
        settings: settings of the rule's kind.

    Raises DrakeTrackerError when a setting is out of range.
    """

    reason = Reason.NO_MATCH

    def __init__(self, settings: Any) -> None:
        check_settings(settings, "target")
        self.settings = settings


class FirstRule(_Rule):
    """Chooses the object that was seen first."""

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns the oldest track."""
        return tracks[0]


class LargestRule(_Rule):
    """Chooses the largest object."""

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns the track of the object with the largest volume."""
        return max(tracks, key=lambda track: float(np.prod(track.shape.dimensions)))


class NearestRule(_Rule):
    """Chooses the object that is nearest to a point."""

    def __init__(self, settings: Nearest = Nearest()) -> None:
        super().__init__(settings)
        if np.shape(settings.point) != (3,) or not np.isfinite(settings.point).all():
            raise DrakeTrackerError(f"target: point is {settings.point!r}; it must be x, y, z in W [m]")

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns the track that is nearest to the point, None when it is not near enough."""
        nearest = min(tracks, key=self._distance)
        return nearest if self._distance(nearest) <= self.settings.within else None

    def _distance(self, track: Track3D) -> float:
        return float(np.linalg.norm(track.position - self.settings.point))


class InsideRule(_Rule):
    """Chooses the first object that is inside a box."""

    def __init__(self, settings: Inside = Inside()) -> None:
        super().__init__(settings)
        self._low, self._high = check_box(settings.box, "target: box")

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns the oldest track inside the box, None without one."""
        return next(filter(self._holds, tracks), None)

    def _holds(self, track: Track3D) -> bool:
        return bool((track.position >= self._low).all() and (track.position <= self._high).all())


class ColouredRule(_Rule):
    """Chooses the object whose hue is most similar to the hue of a colour."""

    def __init__(self, settings: Coloured = Coloured()) -> None:
        super().__init__(settings)
        if not is_colour(settings.colour):
            raise DrakeTrackerError(f"target: colour is {settings.colour!r}; it {COLOUR_RULE}")
        self._hue = hue((255.0 * rgb(settings.colour)).tolist())

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns the track of the most similar hue, None when it differs too much."""
        nearest = min(tracks, key=self._difference)
        return nearest if self._difference(nearest) <= self.settings.tolerance else None

    def _difference(self, track: Track3D) -> float:
        return hue_distance(hue(track.colour), self._hue)


class SelectedRule(_Rule):
    """Leaves the choice to the operator."""

    reason = Reason.NOT_SELECTED

    def choose(self, tracks: Sequence[Track3D]) -> Track3D | None:
        """Returns None: an object becomes the target when the operator selects it (`choose_target`)."""
        return None
