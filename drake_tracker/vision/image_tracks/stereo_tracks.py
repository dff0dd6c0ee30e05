"""Pairs the objects in the images of two calibrated cameras: finds for each track of the left camera the track of the
right camera that shows the same object.

Each camera numbers the tracks of its `ImageTracker` separately. Two tracks show one object if their rays meet in all
images. A pair keeps its number as long as one of its tracks lives. `silhouettes.Tracker` tracks objects by their
silhouettes instead, in metres and with a known background.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.vision.image_tracks.epipolar_association import TrackLink, find_links, link_cost, metres_across
from drake_tracker.vision.image_tracks.image_objects import ImageObjects, count_rivals
from drake_tracker.vision.image_tracks.image_tracker import COAST_TIME, assign
from drake_tracker.vision.image_tracks.object_motion import predict_motion, start_motion, surprise
from drake_tracker.vision.image_tracks.occlusion_by_edges import EdgeMotion, follow_edges, with_whole_regions
from drake_tracker.vision.image_tracks.reidentification import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.stereo_track import StereoTrack, measure_pair
from drake_tracker.vision.image_tracks.track_2d import Track2D, TrackState2D

APART = 1.0
"""Cost from which on two tracks do not show one object, see `link_cost`."""
KNOWN = 0.3
"""Assignment bonus of an existing pair of tracks."""
PART = 0.5
"""Cost of a track that shows only a part of an object."""
SETTLED = 30
"""Number of pairs of images from which on `KNOWN` counts in full."""
_FORBIDDEN = 1e6


@dataclass(frozen=True, eq=False)
class StereoTracks(FrozenState):
    """State of the objects in the images of two cameras.

    Attributes:
        stamp: of the images, the mean of both [s].
        views: the objects in both images, with the numbers of their pairs; tracks without a partner have negative
            numbers. None where an image is missing.
        pairs: all pairs.
        places: numbers of the objects to report, 0 before the first object; the number of a lost object stays.
        links: {(number in the left camera, in the right one): `TrackLink`}.
        edges: {number: `EdgeMotion`} of the left and of the right camera's tracks.
        next_number: of the next new pair.
        switches: number of times that a place was given to another object.
    """

    stamp: float = 0.0
    views: tuple[ImageObjects | None, ImageObjects | None] = (None, None)
    pairs: tuple[StereoTrack, ...] = ()
    places: tuple[int, ...] = ()
    links: Mapping[tuple[int, int], TrackLink] = field(default_factory=dict)
    edges: tuple[Mapping[int, EdgeMotion], Mapping[int, EdgeMotion]] = field(default_factory=lambda: ({}, {}))
    next_number: int = 1
    switches: int = 0

    def pair(self, place: int) -> StereoTrack | None:
        """Returns the pair of a place, or None."""
        return next((pair for pair in self.pairs if pair.number == self.places[place]), None)


class StereoTracker:
    """Finds the pairs. All state is with the caller.

    Args:
        cameras: the left and the right camera, calibrated.
        objects: number of objects to report.
        max_gap: largest distance between the two rays of one object [m].
        stamp_tolerance: largest difference of the stamps of two images of one instant [s].
        follow: whether the first object to report is the first target of both cameras' `ImageTracker`; otherwise it is
            the largest object.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        objects: int,
        *,
        max_gap: float,
        stamp_tolerance: float,
        follow: bool = False,
    ) -> None:
        self.objects = objects
        self._cameras, self._max_gap = (cameras[0], cameras[1]), max_gap
        self._stamp_tolerance, self._follow = stamp_tolerance, follow

    def start(self) -> StereoTracks:
        """Returns the state before the first images."""
        return StereoTracks(places=(0,) * self.objects)

    def update(
        self, known: StereoTracks, stamps: Sequence[float], views: Sequence[ImageObjects | None]
    ) -> StereoTracks:
        """Returns the state after two images.

        Args:
            known: before.
            stamps: of the left and the right image [s].
            views: the objects in them, None where an image is missing.
        """
        together = abs(stamps[0] - stamps[1]) < self._stamp_tolerance
        stamp = 0.5 * (stamps[0] + stamps[1]) if together else max(stamps)
        edges = (follow_edges(known.edges[0], _confirmed(views[0])), follow_edges(known.edges[1], _confirmed(views[1])))
        views = [view and with_whole_regions(view, each) for view, each in zip(views, edges)]
        found = [_confirmed(view) for view in views]
        links = find_links(known.links, found, self._cameras, self._max_gap, stamp, together)
        known = replace(
            known, pairs=tuple(replace(pair, motion=predict_motion(pair.motion, stamp)) for pair in known.pairs)
        )
        joined = self._joined(known.pairs, links, [_parts(*each) for each in zip(edges, found)])
        pairs, next_number = self._identified(known, joined, links, found, stamp)
        shown = [each if each is not None and together else {} for each in found]
        pairs = [
            measure_pair(pair, links.get(pair.tracks), shown, edges, self._cameras, self._max_gap, stamp)
            for pair in pairs
        ]
        after = replace(known, stamp=stamp, pairs=tuple(pairs), links=links, edges=edges, next_number=next_number)
        if None not in found:
            after = self._choose(after, views, found)
        first = after.places[0] if after.pairs else 0
        left, right = (_renumbered(after, side, view, first) for side, view in enumerate(views))
        return replace(after, views=(left, right))

    @staticmethod
    def _joined(
        pairs: Sequence[StereoTrack], links: Mapping[tuple[int, int], TrackLink], parts: Sequence[set[int]]
    ) -> list[tuple[int, int]]:
        """Returns the tracks that show one object each: the assignment of the least total cost.

        A track of a part of an object, ``parts`` in both images, is taken only if there is no other of that object.

        Two tracks whose rays miss each other get the cost of unrelated tracks. An object seen by one camera only can
        therefore not break an existing pair.
        """
        numbers = [sorted({key[side] for key in links}) for side in range(2)]
        if not links:
            return []
        known = {pair.tracks for pair in pairs}
        cost = np.full([len(each) for each in numbers], APART)
        for key, link in links.items():
            if link.hits >= CONFIRM_AFTER:
                bonus = KNOWN * min(link.hits / SETTLED, 1.0)
                i, j = (each.index(number) for each, number in zip(numbers, key))
                extra = PART * any(number in each for number, each in zip(key, parts))
                cost[i, j] = min(link_cost(link) - (bonus if key in known else 0.0) + extra, APART)
        return [(numbers[0][i], numbers[1][j]) for i, j in zip(*assign(cost)) if cost[i, j] < APART]

    def _identified(
        self,
        known: StereoTracks,
        joined: Sequence[tuple[int, int]],
        links: Mapping[tuple[int, int], TrackLink],
        found: Sequence[Mapping[int, Track2D] | None],
        stamp: float,
    ) -> tuple[list[StereoTrack], int]:
        """Returns (the pairs after two images, number of the next new one).

        An object that has lost its track in one camera keeps its number by the other one. Where the tracks of two
        objects were exchanged in one camera, each number goes on with the tracks that lead to where its object is
        expected in space. An object that was followed by one track all the time is expected more exactly than one whose
        track was lost from sight, and may have been exchanged.
        """
        cost = np.full((len(known.pairs), len(joined)), _FORBIDDEN)
        for i, pair in enumerate(known.pairs):
            for j, tracks in enumerate(joined):
                if pair.tracks == tracks:
                    cost[i, j] = 0.0
                elif pair.tracks[0] == tracks[0] or pair.tracks[1] == tracks[1]:
                    cost[i, j] = 1.0 + pair.doubt + self._surprise(pair, tracks, found)
        owners = {int(j): int(i) for i, j in zip(*assign(cost)) if cost[i, j] < _FORBIDDEN} if cost.size else {}
        taken = [{tracks[side] for tracks in joined} for side in range(2)]
        pairs = []
        for i, pair in enumerate(known.pairs):
            if i in owners.values():
                continue
            left, right = (
                0 if number in taken[side] or (alive is not None and number not in alive) else number
                for side, (number, alive) in enumerate(zip(pair.tracks, found))
            )
            if left or right:
                pairs.append(replace(pair, tracks=(left, right)))
        number = known.next_number
        for j, tracks in enumerate(joined):
            if j in owners:
                pairs.append(replace(known.pairs[owners[j]], tracks=tracks))
            else:
                link = links[tracks]
                pairs.append(self._begun(number, tracks, link, found[0], stamp))
                number += 1
        return sorted(pairs, key=lambda pair: pair.number), number

    def _begun(
        self, number: int, tracks: tuple[int, int], link: TrackLink, left: Mapping[int, Track2D] | None, stamp: float
    ) -> StereoTrack:
        """Returns the pair of an object that is new; its size is that in the left image."""
        track = (left or {}).get(tracks[0])
        size = self._max_gap if track is None else metres_across(track, self._cameras[0], link.p_WQ)
        return StereoTrack(number, tracks, link.p_WQ, start_motion(link.p_WQ, size, stamp), usual=link.error)

    def _surprise(
        self, pair: StereoTrack, tracks: tuple[int, int], found: Sequence[Mapping[int, Track2D] | None]
    ) -> float:
        """Returns how unlikely it is that two tracks show the object of a pair, 0 at best."""
        rays = [
            pair.ray(each[number], camera, self._max_gap)
            for each, number, camera in zip(found, tracks, self._cameras)
            if each is not None and number in each
        ]
        return min(sum(surprise(pair.motion, rays)), 0.01 * _FORBIDDEN) if rays else 0.0

    def _choose(
        self,
        paired: StereoTracks,
        views: Sequence[ImageObjects | None],
        found: Sequence[Mapping[int, Track2D] | None],
    ) -> StereoTracks:
        """Returns the pairs with their places: a free place is for the largest object that has none.

        An object that only one camera has seen for `COAST_TIME` gives up its place to an object that both cameras see.
        """

        def pixels(pair: StereoTrack) -> float:
            return sum(each[number].pixel_count for each, number in zip(found, pair.tracks) if each and number in each)

        def recent(pair: StereoTrack) -> bool:
            return paired.stamp - pair.met <= COAST_TIME

        waiting = [pair for pair in paired.pairs if pair.number not in paired.places and recent(pair)]
        waiting.sort(key=pixels, reverse=True)
        places, switches = list(paired.places), paired.switches
        for place, number in enumerate(places):
            holder = paired.pair(place)
            if holder is not None and recent(holder):
                continue
            suited = waiting
            if place == 0 and self._follow:
                wanted = [view.targets[0] for view in views if view is not None]
                suited = [pair for pair in waiting if any(one == other for one, other in zip(pair.tracks, wanted))]
            if suited:
                chosen = suited[0]
                waiting.remove(chosen)
                places[place] = chosen.number
                switches += bool(number)
        return replace(paired, places=tuple(places), switches=switches)


def _confirmed(view: ImageObjects | None) -> Mapping[int, Track2D] | None:
    """Returns {number: track} of the objects in an image that were seen often enough, None without an image."""
    return None if view is None else {track.number: track for track in view.tracks if track.hits >= CONFIRM_AFTER}


def _parts(edges: Mapping[int, EdgeMotion], tracks: Mapping[int, Track2D] | None) -> set[int]:
    """Returns the numbers of the tracks that show only a part of an object."""
    return {number for number, track in (tracks or {}).items() if edges[number].shows_part(track)}


def _renumbered(paired: StereoTracks, side: int, view: ImageObjects | None, first: int) -> ImageObjects | None:
    """Returns the objects in one image with the numbers of their pairs.

    Before the first pair, the first object to report is the first target of the single camera. An object that the image
    shows only in part is hidden.
    """
    if view is None:
        return None
    pairs = {pair.tracks[side]: pair for pair in paired.pairs}
    tracks = []
    for track in view.tracks:
        pair = pairs.get(track.number)
        number = -track.number if pair is None else pair.number
        state = track.state if pair is None or not pair.hidden[side] else TrackState2D.HIDDEN
        tracks.append(replace(track, number=number, state=state))
    targets = (first or -view.targets[0], *paired.places[1:])
    switches = paired.switches if side == 0 else 0
    rivals = count_rivals(tracks, targets) if first else 0
    return replace(view, tracks=tuple(tracks), targets=targets, switches=switches, rivals=rivals)
