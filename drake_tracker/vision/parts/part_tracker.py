"""Tracks the parts on a belt in the images of two cameras: place, direction, kind and identity.

In every image a part is placed anew (`part_fit.fit_part`), near where the belt should have carried it. Foreground that
belongs to no track may be a new part (`part_search.PartSearch`). It is confirmed once it has fitted in several images;
until then its kind is open, and all kinds are compared.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.vision.parts.config import BeltParts
from drake_tracker.vision.parts.part_fit import PartFit, SeenWindow, fit_part, soften
from drake_tracker.vision.parts.part_search import PartCandidate, PartSearch
from drake_tracker.vision.parts.part_silhouette import PartPose, PartSilhouette, Patch
from drake_tracker.vision.parts.part_track import PartTrack

FIRST_STEPS, STEPS = 5, 2
"""Steps of the fit of a new part, and of a tracked part."""
SEARCH_PERIOD = 4
"""Images from one search for new parts to the next."""
SPEED_GAIN = 0.05
"""Share of the surprise about the displacement of the belt by which its speed is corrected, once it is known."""
NEAR, REGAIN = 0.005, 0.03
"""Gate: largest distance of a part from the place to which the belt should have carried it [m]; the gate grows while
the part is not seen [m/s]."""
SEEN_SHARE, WHOLE_SHARE = 0.4, 0.5
"""Shares of the outlines that must not be hidden, for a part to be seen and for a new part to be judged."""
KNOWN = 2.0
"""Misfit that a known part may have, as a multiple of a new one's."""
UNCLEAR_SHARE = 0.6
"""Share of the outline of an unclear object that must be foreground for the object to be present."""
FULL = 0.85
"""Share of a part's outlines that stands out from the belt where something else covers the part."""
UNCLEAR_VARIANCE = 1.0
"""Variance of the place [m^2] and direction [rad^2] of an unclear object, so large that no dispatcher picks it."""
SAME_PLACE = 0.02
"""Parts whose middles are closer than this are one [m]."""
_AROUND, _INNER = np.ones((5, 5), np.uint8), np.ones((5, 5), np.uint8)
_Around = tuple[slice, slice, np.ndarray]
"""Rows and columns of a rectangle of a window, and which of its pixels are meant."""


@dataclass(frozen=True, eq=False)
class PartTrackerState(FrozenState):
    """State of a `PartTracker`.

    Attributes:
        stamp: of the newest images [s].
        tracks: of all parts.
        speed: of the belt [m/s].
        count: pairs of images so far.
        travels: number of those from which the displacement of the belt was measured.
        last: the highest number that a part has had.
    """

    stamp: float = -math.inf
    tracks: tuple[PartTrack, ...] = ()
    speed: float = 0.0
    count: int = 0
    travels: int = 0
    last: int = 0


@dataclass(frozen=True, eq=False)
class PartImage:
    """Content of one camera's image.

    Attributes:
        mask: uint8 (h, w), 255 on the foreground.
        unseen: uint8 (h, w), 255 where the image shows neither the belt nor objects on the belt.
    """

    mask: np.ndarray
    unseen: np.ndarray


@dataclass(frozen=True)
class PartTracker:
    """Tracks parts. It is functional: all state is with the caller.

    Attributes:
        silhouettes: of each camera.
        search: for new parts.
        end: y at which a part leaves the view [m].
        settings: `BeltParts`.
    """

    silhouettes: Sequence[PartSilhouette]
    search: PartSearch
    end: float
    settings: BeltParts = field(default_factory=BeltParts)

    def update(self, state: PartTrackerState, stamp: float, images: Sequence[PartImage]) -> PartTrackerState:
        """Returns the state after a pair of images.

        Args:
            state: the state before.
            stamp: capture time of the images [s].
            images: of the cameras, in their order.
        """
        dt = stamp - state.stamp if math.isfinite(state.stamp) else 0.0
        windows = [
            SeenWindow(
                silhouette,
                soften(image.mask.astype(np.float32) / 255.0),
                cv2.erode(cv2.bitwise_not(image.unseen), _INNER).astype(np.float32) / 255.0,
            )
            for silhouette, image in zip(self.silhouettes, images)
        ]
        tracks, travel = self._followed(state, stamp, windows, state.speed * dt)
        speed, travels = state.speed, state.travels
        if dt > 0.0 and travel is not None:
            travels += 1
            speed += max(1.0 / travels, SPEED_GAIN) * (travel / dt - speed)
        if state.count % SEARCH_PERIOD == 0:
            tracks = self._new(tracks, stamp, images, windows)
        kept, last = [], state.last
        for track in tracks:
            if self._is_over(track, stamp):
                continue
            if track.number == 0 and track.images >= self.settings.confirm_after:
                last += 1
                track = track.confirmed(last)
            kept.append(track)
        return PartTrackerState(stamp, tuple(kept), speed, state.count + 1, travels, last)

    def _followed(
        self, state: PartTrackerState, stamp: float, windows: Sequence[SeenWindow], expected: float
    ) -> tuple[list[PartTrack], float | None]:
        """Returns the tracks after the images, and how far the belt moved [m], None when no part tells.

        Args:
            state: the state before the images.
            stamp: of the images [s].
            windows: what they show.
            expected: distance by which the belt should have moved [m].
        """
        moved = [track.moved(expected) for track in state.tracks]
        outlines = [[window.silhouette.patch(track.pose) for window in windows] for track in moved]
        results: list[PartTrack | None] = []
        travels = []
        around = [_around(each) for each in outlines]
        for k, track in enumerate(moved):
            own = _without(windows, around[:k] + around[k + 1 :])
            result = self._seen_again(track, stamp, own, outlines[k], state.stamp - track.seen)
            results.append(result)
            if result is not None and result.clear and result.seen == stamp:
                travels.append(result.pose.y - state.tracks[k].pose.y)
        travel = float(np.median(travels)) if travels else None
        surprise = 0.0 if travel is None else travel - expected
        kept = [
            result if result.clear and result.seen == stamp else result.moved(surprise)
            for result in results
            if result is not None
        ]
        return kept, travel

    def _seen_again(
        self,
        track: PartTrack,
        stamp: float,
        windows: Sequence[SeenWindow],
        outlines: Sequence[Patch | None],
        unseen: float,
    ) -> PartTrack | None:
        """Returns a track after the images; None when a new one was none.

        Args:
            track: the track, which has moved with the belt.
            stamp: of the images [s].
            windows: what they show, without the other parts.
            outlines: silhouettes of the track in them.
            unseen: time for which the part had not been seen before the images [s].
        """
        if not track.clear:
            fit = fit_part(windows, track.pose, 1, outlines)
            there = fit is not None and fit.share >= SEEN_SHARE and fit.filled >= UNCLEAR_SHARE
            return track.found(track.fit, stamp) if there else track
        if track.number == 0:
            rivals = {}
            for kind, rival in track.rivals.items():
                fit = fit_part(windows, rival.pose, STEPS)
                if fit is not None and fit.share >= WHOLE_SHARE:
                    rivals[kind] = fit
            if rivals and min(fit.misfit for fit in rivals.values()) <= self.settings.largest_misfit:
                return track.compared(rivals, stamp)
            return None
        fit = fit_part(windows, track.pose, FIRST_STEPS if unseen > 0.0 else STEPS, outlines)
        if fit is None or fit.share < SEEN_SHARE:
            return replace(track, visible=stamp)
        near = min(NEAR + REGAIN * unseen, SAME_PLACE)
        if fit.misfit <= KNOWN * self.settings.largest_misfit and _distance(fit.pose, track.pose) <= near:
            return track.found(fit, stamp)
        return replace(track, visible=stamp) if fit.filled >= FULL else track

    def _new(
        self,
        tracks: Sequence[PartTrack],
        stamp: float,
        images: Sequence[PartImage],
        windows: Sequence[SeenWindow],
    ) -> list[PartTrack]:
        """Returns the tracks, tracks of candidate parts included.

        Unclear objects are examined again: an unclear object gives way to a part that is found in its place.
        """
        known = [track for track in tracks if track.clear]
        masks = [image.mask.copy() for image in images]
        drawn = [[window.silhouette.patch(track.pose) for window in windows] for track in known]
        for outlines in drawn:
            for mask, patch in zip(masks, outlines):
                if patch is not None:
                    covered = cv2.dilate((patch.share > 0.0).astype(np.uint8), _AROUND)
                    mask[patch.rows, patch.columns][covered > 0] = 0
        candidates = [
            each
            for each in self.search.candidates(masks, [image.unseen for image in images])
            if not _is_near(each.poses[each.kind], known)
        ]
        outlines_of = [[window.silhouette.patch(each.poses[each.kind]) for window in windows] for each in candidates]
        found = []
        around = [_around(each) for each in (*outlines_of, *drawn)] if candidates else []
        for k, candidate in enumerate(candidates):
            track = self._begun(candidate, stamp, _without(windows, around[:k] + around[k + 1 :]))
            if track is not None:
                found.append(track)
        clear = known + [track for track in found if track.clear]
        unclear = [track for track in tracks if not track.clear and not _is_near(track.pose, clear)]
        new = [track for track in found if not track.clear and not _is_near(track.pose, clear + unclear)]
        return clear + unclear + new

    def _begun(self, candidate: PartCandidate, stamp: float, windows: Sequence[SeenWindow]) -> PartTrack | None:
        """Returns the track of a candidate, None when too little of it is seen."""
        rivals: dict[PartKind, PartFit] = {}
        for kind, pose in candidate.poses.items():
            fit = fit_part(windows, pose, FIRST_STEPS)
            if fit is not None and fit.share >= WHOLE_SHARE:
                rivals[kind] = fit
        if not rivals:
            return None
        best = min(rivals.values(), key=lambda fit: fit.misfit)
        if best.misfit > self.settings.largest_misfit:
            rough = replace(best, pose=candidate.poses[candidate.kind], covariance=UNCLEAR_VARIANCE * np.eye(3))
            return PartTrack(0, False, rough, stamp, stamp, 1, {}, {})
        return PartTrack(0, True, best, stamp, stamp, 1, rivals, {kind: fit.misfit for kind, fit in rivals.items()})

    def _is_over(self, track: PartTrack, stamp: float) -> bool:
        """Returns whether a part has left the view, or was not seen for too long."""
        settings = self.settings
        left = track.pose.y - PART_SHAPES[track.pose.kind].radius > self.end
        return left or stamp - track.visible > settings.lost_after or stamp - track.seen > settings.coast_time


def _around(outlines: Sequence[Patch | None]) -> list[_Around | None]:
    """Returns the pixels on and around the silhouettes of one part in all windows."""
    return [
        None if patch is None else (patch.rows, patch.columns, cv2.dilate(patch.share, _AROUND) > 0.0)
        for patch in outlines
    ]


def _without(windows: Sequence[SeenWindow], others: Sequence[Sequence[_Around | None]]) -> list[SeenWindow]:
    """Returns windows in which the pixels of other parts, from `_around`, count neither for nor against a place."""
    if not others:
        return list(windows)
    result = []
    for window, hidden in zip(windows, zip(*others)):
        weight = window.weight.copy()
        for each in hidden:
            if each is not None:
                rows, columns, pixels = each
                weight[rows, columns][pixels] = 0.0
        result.append(window._replace(weight=weight))
    return result


def _is_near(pose: PartPose, tracks: Sequence[PartTrack]) -> bool:
    """Returns whether a pose belongs to one of the tracks."""
    return any(_distance(pose, track.pose) < SAME_PLACE for track in tracks)


def _distance(a: PartPose, b: PartPose) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)
