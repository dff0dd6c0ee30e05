"""An object in space, followed by a track in each of two cameras."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.image_identity import CONFIRM_AFTER
from drake_tracker.vision.image_track import LIKE, ImageTrack, TrackState
from drake_tracker.vision.image_tracker import COAST_TIME
from drake_tracker.vision.object_links import Link
from drake_tracker.vision.partly_hidden import EdgeMotion
from drake_tracker.vision.stereo_geometry import GATE

LEAST_GAP = 1.0 / 16.0
"""Standard deviation of a gap that is always usual, as a share of the largest one."""
USUAL_WEIGHT = 0.02
"""Weight of the newest gap in the usual one."""
SPEED_WEIGHT = 0.2
"""Weight of the newest velocity."""


@dataclass(frozen=True, eq=False)
class ObjectPair(FrozenState):
    """An object, and its tracks in both cameras.

    Attributes:
        number: its identity, from 1 on.
        tracks: numbers of its tracks in the left and in the right camera; 0 where it has none.
        p_WQ: its newest point, shape (3,) [m].
        v_WQ: its velocity, shape (3,) [m/s].
        met: stamp of that point [s], before the first one minus infinity; ``p_WQ`` is then between two rays.
        gap: between its two rays in the newest images [m], 0 where they do not meet.
        usual: mean square of the gaps of its points, as a share of the largest gap.
        hidden: whether the left and the right image hide it, or a part of it.
    """

    number: int
    tracks: tuple[int, int]
    p_WQ: np.ndarray
    v_WQ: np.ndarray
    met: float = -math.inf
    gap: float = 0.0
    usual: float = 0.0
    hidden: tuple[bool, bool] = (False, False)

    def distance(self, p_WQ: np.ndarray, stamp: float) -> float:
        """Returns how far a point is from where the object is expected [m]."""
        ahead = min(stamp - self.met, COAST_TIME)
        return float(np.linalg.norm(self.p_WQ + ahead * self.v_WQ - p_WQ))


def measure_pair(
    pair: ObjectPair,
    link: Link | None,
    found: Sequence[Mapping[int, ImageTrack] | None],
    edges: Sequence[Mapping[int, EdgeMotion]],
    stamp: float,
) -> ObjectPair:
    """Returns a pair with its point, if both images show all of it and the gap is not unusually large.

    An object that stands in one image and moves in the other is hidden where it stands, which is where it was seen
    last. One that appears much smaller in one image than in the other is hidden there.

    Args:
        pair: before.
        link: of its two tracks, None without one.
        found: {number: track} of the left and the right image, None where an image is missing.
        edges: {number: edges} of the left and the right image.
        stamp: of the images [s].
    """
    if link is None or link.stamp < stamp or link.hits < CONFIRM_AFTER:
        return replace(pair, gap=0.0, hidden=(False, False))
    left, right = (each[number] for each, number in zip(found, pair.tracks) if each is not None)
    one_hidden, other_hidden = (
        each[one.number].shows_part(one)
        or (one.state == TrackState.STANDING and other.state == TrackState.MOVING)
        or sign * link.sizes > 0.5 * math.log(LIKE)
        for each, one, other, sign in zip(edges, (left, right), (right, left), (-1.0, 1.0))
    )
    pair = replace(pair, gap=link.gap if np.isfinite(link.gap) else 0.0, hidden=(one_hidden, other_hidden))
    if link.share**2 > min(GATE * (pair.usual + LEAST_GAP**2), 1.0) or one_hidden or other_hidden:
        return pair
    dt, v_WQ = stamp - pair.met, pair.v_WQ
    if dt > 0.0:
        v_WQ = read_only(v_WQ + SPEED_WEIGHT * ((link.p_WQ - pair.p_WQ) / dt - v_WQ))
    usual = pair.usual + USUAL_WEIGHT * (link.share**2 - pair.usual)
    return replace(pair, p_WQ=link.p_WQ, v_WQ=v_WQ, met=stamp, usual=usual)
