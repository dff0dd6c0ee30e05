"""How well the rays to two tracks, one of each camera, have met so far: whether they may show one object."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.image_tracks.track_2d import Track2D

WEIGHT = 0.1
"""Weight of the newest images."""
FORGOTTEN = 0.25
"""Time after which a track that was not seen in both images may show another object [s]."""
WORST = 4.0
"""Largest error of a pair of images, so that a single one does not count for many."""
SIZE_WEIGHT = 0.3
"""Cost of sizes that differ by a factor of e, see `link_cost`."""
GREY_WEIGHT = 1.0 / 200.0
"""Cost of a difference by one grey level."""


@dataclass(frozen=True, eq=False)
class TrackLink(FrozenState):
    """The evidence that a track of the left camera and a track of the right camera show one object.

    Attributes:
        hits: number of pairs of images in which both were seen.
        error: mean square of the gap between the two rays, as a share of the largest gap.
        unlike: mean difference of appearance, see `link_cost`.
        sizes: logarithm of the ratio of its newest sizes [m] as the two images show them, left to right.
        p_WQ: newest point between the rays, shape (3,) [m].
        gap: newest gap [m], infinite where the rays do not meet.
        share: the same as a share of the largest gap.
        stamp: of the newest pair of images [s].
    """

    hits: int
    error: float
    unlike: float
    p_WQ: np.ndarray
    gap: float
    share: float
    stamp: float
    sizes: float = 0.0


def find_links(
    known: Mapping[tuple[int, int], TrackLink],
    found: Sequence[Mapping[int, Track2D] | None],
    cameras: Sequence[CameraModel],
    max_gap: float,
    stamp: float,
    together: bool,
) -> dict[tuple[int, int], TrackLink]:
    """Returns the links after a pair of images, {(number in the left camera, in the right one): `TrackLink`}.

    Args:
        known: the links before.
        found: {number: track} of the left and the right image, None where an image is missing.
        cameras: left and right.
        max_gap: largest distance between the two rays of one object [m].
        stamp: of the images [s].
        together: whether both were captured at the same instant.
    """
    links = {
        key: link
        for key, link in known.items()
        if all(each is None or number in each for each, number in zip(found, key))
    }
    left, right = ({} if each is None or not together else each for each in found)
    for one in left.values():
        for other in right.values():
            if one.seen < one.stamp or other.seen < other.stamp:
                continue
            key = (one.number, other.number)
            before = links.get(key)
            if before is None or stamp - before.stamp > FORGOTTEN:
                before = TrackLink(0, 0.0, 0.0, read_only(np.full(3, np.nan)), np.inf, np.inf, stamp)
            links[key] = _updated(before, one, other, cameras, max_gap, stamp)
    return links


def link_cost(link: TrackLink) -> float:
    """Returns the evidence against one object: gaps, and differences of size and brightness; near 0 for one object."""
    return math.sqrt(link.error) + link.unlike


def _updated(
    link: TrackLink, one: Track2D, other: Track2D, cameras: Sequence[CameraModel], max_gap: float, stamp: float
) -> TrackLink:
    meeting = triangulate(cameras[0], cameras[1], one.place.tolist(), other.place.tolist())
    unlike, p_WQ, gap, ratio = link.unlike, link.p_WQ, np.inf, 0.0
    if meeting is not None:
        p_WQ, gap = read_only(meeting.p_WQ), meeting.gap
        sizes = [metres_across(track, camera, p_WQ) for track, camera in zip((one, other), cameras)]
        greys = [float(track.patch.mean()) if track.patch.size else 0.0 for track in (one, other)]
        ratio = math.log(sizes[0] / sizes[1])
        unlike = SIZE_WEIGHT * abs(ratio) + GREY_WEIGHT * abs(greys[0] - greys[1])
    share = gap / max_gap
    weight = max(1.0 / (link.hits + 1), WEIGHT)
    return TrackLink(
        hits=link.hits + 1,
        error=link.error + weight * (min(share**2, WORST) - link.error),
        unlike=link.unlike + weight * (unlike - link.unlike),
        p_WQ=p_WQ,
        gap=gap,
        share=share,
        stamp=stamp,
        sizes=ratio,
    )


def metres_across(track: Track2D, camera: CameraModel, p_WQ: np.ndarray) -> float:
    """Returns the size of an object [m], from that in the image, if it is at a point (3,) [m]."""
    size = track.size if track.region is None else track.region.extent
    return size * math.dist(p_WQ, camera.X_WC[:3, 3]) / camera.focal_lengths[0]
