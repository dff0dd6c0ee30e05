"""Re-identification: whether a track and the content of an image are the same object, which may have no region, be
occluded, or be seen again."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from drake_tracker.vision.image_tracks.empty_scene import BEYOND
from drake_tracker.vision.image_tracks.image_patch import SAME, SURE, cut_patch, find_patch, is_scene
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.track_2d import Track2D, TrackState2D
from drake_tracker.vision.image_tracks.track_2d import measure as measure_track

CONFIRM_AFTER = 4
"""Images in which a new object must be seen before it counts."""
MERGED_REACH = 0.3
"""Among other objects, an object's patch is looked for within this share of its size."""
TOGETHER, TOGETHER_TIME = 0.25, 0.2
"""Two tracks that stay closer than this share of their size for this time [s] show the same object."""
COMPANY = 1.5
"""Objects are near each other up to this distance, as a share of the sum of their sizes."""
FAST = 0.2
"""Share of its size above which an object's motion between images counts as fast."""
SETTLED = 1.0
"""Speed below which an object may have changed its look where it is, in sizes per second."""
STOOD = 0.25
"""An object that stood has not moved on while it is within this share of its size."""


def without_region(
    track: Track2D, image: np.ndarray, gate: float, inside: bool, whole: ImageRegion | None = None
) -> Track2D:
    """Returns a predicted track without a separate region: its object stands, or is merged with another object.

    A merged object may be occluded by the other object, and is then expected to move on as before.

    Args:
        track: predicted for the time of the image.
        image: grey uint8 (h, w).
        gate: distance from the prediction that is searched [px].
        inside: whether its prediction lies in a region.
        whole: its silhouette in front of the scene, if known.
    """
    unlike = track.unlike + 1 if inside else track.unlike
    if track.hits < CONFIRM_AFTER:
        return replace(track, state=TrackState2D.HIDDEN, unlike=unlike)
    reach, least = (MERGED_REACH * track.size, SURE) if inside else (min(gate, 1.5 * track.size), SAME)
    found = u, v, score = find_patch(track.patch, track.centre, track.mean[:2], image, reach)
    missed = score < least or is_scene(track.patch, track.centre, found, track.scenes)
    if whole is not None and (missed or np.hypot(u - whole.u, v - whole.v) > BEYOND * whole.extent):
        patch, centre = cut_patch(image, whole)  # its look has changed
        track = replace(track, patch=patch, centre=centre, width=whole.width, height=whole.height)
        u, v = whole.u, whole.v
    elif missed:
        return replace(track, state=TrackState2D.HIDDEN, unlike=unlike)
    measured = measure_track(track, u, v)
    state = TrackState2D.STANDING if measured.slow and not inside else TrackState2D.MOVING
    return replace(measured, state=state, unlike=unlike)


def left_its_place(track: Track2D, region: ImageRegion, image: np.ndarray) -> bool:
    """Returns whether the motion where an object stood shows that it is gone, or covered by another."""
    moved = np.hypot(region.u - track.mean[0], region.v - track.mean[1])
    if not track.slow or track.hits < CONFIRM_AFTER or moved > STOOD * track.size:
        return False
    return find_patch(track.patch, track.centre, track.mean[:2], image, STOOD * track.size)[2] < SURE


def found_again(hidden: Track2D, free: Sequence[Track2D], early: float) -> Track2D | None:
    """Returns the new track that shows a hidden object, which has moved on in another way than expected, or None.

    Args:
        hidden: its track.
        free: tracks that are no targets.
        early: time by which motion may appear at the new place before it ends at the old one [s].
    """
    alike = [
        track
        for track in free
        if track.hits >= CONFIRM_AFTER and track.since > hidden.seen - early and is_same_object(hidden, track)
    ]
    return min(alike, key=lambda track: float(np.hypot(*(track.mean - hidden.mean)[:2])), default=None)


def without_doubles(before: Sequence[Track2D], after: Sequence[Track2D], targets: Sequence[int]) -> list[Track2D]:
    """Returns the tracks without duplicates of one object.

    This is so if it was found again and they began while it was hidden, or if they move along with it at its place.

    Args:
        before: all tracks before an image.
        after: the same tracks after it.
        targets: numbers of the objects to report, which stay.
    """
    hidden = {track.number: track.seen for track in before if track.state == TrackState2D.HIDDEN}
    again = [track for track in after if track.number in hidden and track.seen == track.stamp]
    kept: list[Track2D] = []
    for track in sorted(after, key=lambda track: (track.number not in targets, track.number)):
        began_meanwhile = any(
            track.since > hidden[found.number] and distance_from(found, track.mean[:2]) < 0.5 * track.size
            for found in again
            if found.number != track.number
        )
        twin = track.number not in targets and any(_move_together(track, other) for other in kept)
        if not began_meanwhile and not twin:
            kept.append(track)
    return sorted(kept, key=lambda track: track.number)


def in_company(track: Track2D, others: Sequence[Track2D]) -> bool:
    """Returns whether another confirmed object is near an object.

    Args:
        track: of the object.
        others: all tracks, which may include it.
    """
    return any(
        float(np.hypot(*(other.mean - track.mean)[:2])) < COMPANY * (other.size + track.size)
        for other in others
        if other.number != track.number and other.hits >= CONFIRM_AFTER
    )


def _move_together(track: Track2D, other: Track2D) -> bool:
    """Returns whether two tracks that are seen are at the same place, and move alike."""
    if min(track.hits, other.hits) < CONFIRM_AFTER or track.seen < track.stamp or other.seen < other.stamp:
        return False
    apart = track.mean - other.mean
    near = TOGETHER * min(track.size, other.size)
    return bool(np.hypot(*apart[:2]) < near and np.hypot(*apart[2:]) * TOGETHER_TIME < near)


def is_leap(hidden: Track2D, found: Track2D) -> bool:
    """Returns whether a hidden object was found again farther away than it can have moved."""
    reach = 2.0 * (hidden.size + max(hidden.speed, found.speed) * (found.stamp - hidden.seen))
    return bool(np.hypot(*(found.mean[:2] - hidden.place)) > reach)


def is_same_object(old: Track2D, track: Track2D) -> bool:
    """Returns whether a new track shows an object that was lost: by its size, and by its patch.

    The patch of an object that was lost before its confirmation may show the scene. Then only the size counts: the size
    of the object, or of the exact region inside of its last region.
    """
    areas = [old.area]
    if old.hits < CONFIRM_AFTER and old.region is not None and old.region.inner is not None:
        areas.append(float(old.region.inner.width * old.region.inner.height))
    if not any(0.5 < track.area / area < 2.0 for area in areas):
        return False
    if old.hits < CONFIRM_AFTER:
        return True
    size = tuple(reversed(old.patch.shape))
    score = cv2.matchTemplate(cv2.resize(track.patch, size), old.patch, cv2.TM_CCOEFF_NORMED)[0, 0]
    return bool(abs(float(track.patch.mean()) - float(old.patch.mean())) < 30.0 and score > 0.4)


def distance_from(track: Track2D, point: tuple[float, float] | np.ndarray) -> float:
    """Returns the distance of a pixel from the rectangle round an object [px]."""
    aside = np.maximum(np.abs(track.mean[:2] - point) - 0.5 * np.array([track.width, track.height]), 0.0)
    return float(np.hypot(*aside))


def may_be_fast(tracks: Sequence[Track2D], reach: float) -> bool:
    """Returns whether an object may move by a good part of its size between images, or is not seen where it was.

    Args:
        tracks: before the image.
        reach: time from the image to the others with which it is compared [s].
    """
    known = [track for track in tracks if track.hits >= CONFIRM_AFTER]
    return not known or any(track.seen < track.stamp or track.speed * reach > FAST * track.size for track in known)
