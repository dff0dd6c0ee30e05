"""Detects that an image shows only a part of a moving object: the centroid of a part is not the centroid of the object.

Where something hides an object, or the border of the image cuts it, an edge of its region stands still while the
opposite one moves on with the object. An edge that moves much farther than the object says nothing: where an object
stops or starts, only some of its edges show motion, and the region is too small.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.track_2d import SURE_SIZE, Track2D

LEAST_STEP = 6.0
"""Least motion of an edge for a comparison with the opposite edge [px]."""
STILL_SHARE = 0.25
"""An edge stands still when it moves by less than this share of the motion of the opposite one."""
CARRIED_SHARE = 0.25
"""Least motion of the object, as a share of the motion of the moving edge; half of it if the place is the middle of the
visible part."""
LONGEST = 1.5
"""Time over which the motion of edges is compared [s]."""
BESIDE = 0.15
"""Share of its size by which an object may be beside the middle of its region."""


@dataclass(frozen=True, eq=False)
class EdgeMotion(FrozenState):
    """The newest edges of an object's region.

    Attributes:
        stamps: of the images [s], oldest first.
        edges: columns of the left and the right, rows of the top and the bottom edge in them [px].
        places: of the object in them (u, v) [px].
        part: whether only a part of the object is seen; so until it has moved freely.
        free: whether its opposite edges move alike: its region then shows all of it.
    """

    stamps: tuple[float, ...] = ()
    edges: tuple[tuple[float, float, float, float], ...] = ()
    places: tuple[tuple[float, float], ...] = ()
    part: bool = False
    free: bool = False

    def after(self, track: Track2D) -> "EdgeMotion":
        """Returns the edges after an image.

        Args:
            track: of the object, in that image.
        """
        region = track.region
        if region is None or track.seen < track.stamp:
            return self
        now = (
            float(region.left),
            float(region.left + region.width),
            float(region.top),
            float(region.top + region.height),
        )
        first = next((k for k, stamp in enumerate(self.stamps) if track.stamp - stamp <= LONGEST), len(self.stamps))
        stamps, edges = (*self.stamps[first:], track.stamp), (*self.edges[first:], now)
        places = (*self.places[first:], (float(track.place[0]), float(track.place[1])))
        stands = _stands(edges, places)
        return EdgeMotion(stamps, edges, places, self.part if stands is None else stands, stands is False)

    def shows_part(self, track: Track2D) -> bool:
        """Returns whether an image shows only a part of the object, or finds it beside its region.

        Args:
            track: of the object, in the newest image.
        """
        region = track.region
        beside = 0.0 if region is None else math.hypot(*(track.place - (region.u, region.v)))
        return self.part or beside > BESIDE * track.size


def with_whole_regions(view: ImageObjects, edges: Mapping[int, EdgeMotion]) -> ImageObjects:
    """Returns the objects in an image, those whose region moves freely and has their size at its centroid.

    A track that began with a partly visible object may continue with this part only, beside the region of the object.

    Args:
        view: the objects.
        edges: {number: edges} of their regions.
    """
    tracks = []
    for track in view.tracks:
        region, motion = track.region, edges.get(track.number)
        if (
            region is not None
            and motion is not None
            and motion.free
            and track.seen == track.stamp
            and _has_size(track, region)
        ):
            track = replace(track, place=read_only(np.array([region.u, region.v])))
        tracks.append(track)
    return replace(view, tracks=tuple(tracks))


def follow_edges(known: Mapping[int, EdgeMotion], tracks: Mapping[int, Track2D] | None) -> Mapping[int, EdgeMotion]:
    """Returns the edges of the regions of all tracks after an image, those before where the image is missing.

    Args:
        known: {number: edges} before.
        tracks: {number: track} in the image, None without one.
    """
    if tracks is None:
        return known
    return {number: known.get(number, EdgeMotion()).after(track) for number, track in tracks.items()}


def _has_size(track: Track2D, region: ImageRegion) -> bool:
    """Returns whether a region has the width and the height of an object, and therefore shows no other one with it."""
    return all(
        1.0 / SURE_SIZE < ratio < SURE_SIZE for ratio in (region.width / track.width, region.height / track.height)
    )


def _stands(
    edges: tuple[tuple[float, float, float, float], ...], places: tuple[tuple[float, float], ...]
) -> bool | None:
    """Returns whether one of two opposite edges stands still, None where neither has moved far enough."""
    known = None
    for axis, low, high in ((0, 0, 1), (1, 2, 3)):
        for earlier, place in zip(reversed(edges[:-1]), reversed(places[:-1])):
            less, more = sorted((edges[-1][low] - earlier[low], edges[-1][high] - earlier[high]), key=abs)
            carried = math.copysign(1.0, more) * (places[-1][axis] - place[axis])
            if abs(more) >= LEAST_STEP and carried >= CARRIED_SHARE * abs(more):
                known = bool(known) or abs(less) < STILL_SHARE * abs(more)
                break
    return known
