"""An object in space, followed by a track in each of two cameras."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.vision.image_tracks.epipolar_association import FORGOTTEN, TrackLink
from drake_tracker.vision.image_tracks.object_motion import ObjectMotion, ObjectRay, ray_to, surprise, with_rays
from drake_tracker.vision.image_tracks.occlusion_by_edges import EdgeMotion
from drake_tracker.vision.image_tracks.reidentification import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.track_2d import LIKE, Track2D, TrackState2D

GATE = 16.0
"""Squared Mahalanobis distance up to which a ray may lead to an object: 99.97 % in two dimensions. Gaps up to its root
times the usual one belong to one object."""
LEAST_GAP = 1.0 / 16.0
"""Standard deviation of a gap that counts as usual in any case, as a share of the largest allowed gap."""
USUAL_WEIGHT = 0.02
"""Weight of the newest gap in the usual one."""
_SMALLER = 0.5 * math.log(LIKE)
_STANDS_ALONE = (TrackState2D.STANDING, TrackState2D.MOVING)


@dataclass(frozen=True, eq=False)
class StereoTrack(FrozenState):
    """An object, and its tracks in both cameras.

    Attributes:
        number: its identity, from 1 on.
        tracks: numbers of its tracks in the left and in the right camera; 0 where it has none.
        p_WQ: its newest point, shape (3,) [m].
        motion: where it is expected.
        met: stamp of that point [s], before the first one minus infinity; ``p_WQ`` is then between two rays.
        gap: between its two rays in the newest images [m], 0 where they do not meet.
        usual: mean square of the gaps of its points, as a share of the largest gap.
        hidden: whether the object is occluded, at least in part, in the left and in the right image.
        followed: stamps [s] of the newest left and right image whose ray its motion has taken.
        doubt: how unlikely it was that the tracks seen again since its newest point still showed it, 0 at best.
        again: whether the images before could give its first point after a while.
    """

    number: int
    tracks: tuple[int, int]
    p_WQ: np.ndarray
    motion: ObjectMotion
    met: float = -math.inf
    gap: float = 0.0
    usual: float = 0.0
    hidden: tuple[bool, bool] = (False, False)
    followed: tuple[float, float] = (-math.inf, -math.inf)
    doubt: float = 0.0
    again: bool = False

    def ray(self, track: Track2D, camera: CameraModel, max_gap: float) -> ObjectRay:
        """Returns the ray to a track in the image of a camera, with the error that the gaps between its rays suggest.

        Args:
            track: that may be its own.
            camera: calibrated.
            max_gap: largest distance between the two rays of one object [m].
        """
        return ray_to(track, camera, self.motion.mean[:3], max_gap * math.sqrt(0.5 * (self.usual + LEAST_GAP**2)))


def measure_pair(
    pair: StereoTrack,
    link: TrackLink | None,
    shown: Sequence[Mapping[int, Track2D]],
    edges: Sequence[Mapping[int, EdgeMotion]],
    cameras: Sequence[CameraModel],
    max_gap: float,
    stamp: float,
) -> StereoTrack:
    """Returns a pair with its point, if both images show the whole object and the gap is not unusually large.

    An object that stands in one image and moves in the other is hidden where it stands, which is where it was seen
    last. An object that appears much smaller in one image than in the other is partly occluded in that image. Where one
    image alone shows all of an object, it is followed along the ray of that image. After a while without a point, the
    first one does not
    count: the tracks may no longer show one object, and may seem to show the whole object in a single image.

    Args:
        pair: before, predicted for the time of the images.
        link: of its two tracks, None without one.
        shown: {number: track} of the left and the right image, if both were captured at the same instant.
        edges: {number: edges} of the left and the right image.
        cameras: left and right.
        max_gap: largest distance between the two rays of one object [m].
        stamp: of the images [s].
    """
    seen = [each.get(number) for each, number in zip(shown, pair.tracks)]
    seen = [None if track is None or track.seen < track.stamp else track for track in seen]
    part = [track is not None and each[track.number].shows_part(track) for each, track in zip(edges, seen)]
    left, right = seen
    if left is None or right is None or link is None or link.stamp < stamp or link.hits < CONFIRM_AFTER:
        pair = replace(pair, gap=0.0, hidden=(False, False), again=False)
        one_alone = left is None or right is None
        return _along(pair, seen, part, cameras, max_gap) if one_alone else pair
    hidden = (
        part[0] or (left.state, right.state) == _STANDS_ALONE or -link.sizes > _SMALLER,
        part[1] or (right.state, left.state) == _STANDS_ALONE or link.sizes > _SMALLER,
    )
    again, pair = pair.again, replace(pair, gap=link.gap if np.isfinite(link.gap) else 0.0, hidden=hidden, again=False)
    if any(hidden):
        return pair if all(hidden) else _along(pair, seen, hidden, cameras, max_gap)
    if link.share**2 > min(GATE * (pair.usual + LEAST_GAP**2), 1.0):
        return pair
    rays = [pair.ray(track, camera, max_gap) for track, camera in zip((left, right), cameras)]
    motion = with_rays(pair.motion, rays)
    if stamp - pair.met > FORGOTTEN and not again:
        pair = replace(pair, again=True)
        return replace(pair, motion=motion, followed=(stamp, stamp)) if pair.met == -math.inf else pair
    usual = pair.usual + USUAL_WEIGHT * (link.share**2 - pair.usual)
    return replace(pair, p_WQ=link.p_WQ, motion=motion, met=stamp, usual=usual, followed=(stamp, stamp), doubt=0.0)


def _along(
    pair: StereoTrack,
    seen: Sequence[Track2D | None],
    hidden: Sequence[bool],
    cameras: Sequence[CameraModel],
    max_gap: float,
) -> StereoTrack:
    """Returns a pair updated along the only ray to the whole object, if there is exactly one and the ray is near.

    A track that was not seen for a while may show another object now: this is the pair's doubt.
    """
    stamp = pair.motion.stamp
    for side, (track, camera) in enumerate(zip(seen, cameras)):
        if track is not None and not hidden[side]:
            rays = [pair.ray(track, camera, max_gap)]
            distance, uncertain = surprise(pair.motion, rays)
            if distance <= GATE:
                followed = (stamp, pair.followed[1]) if side == 0 else (pair.followed[0], stamp)
                again = stamp - pair.followed[side] > FORGOTTEN
                doubt = pair.doubt + (distance + uncertain if again else 0.0)
                return replace(pair, motion=with_rays(pair.motion, rays), followed=followed, doubt=doubt)
    return pair
