"""Learned appearance of an object: size, height and colour, and the comparison of objects by appearance."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.messages import TrackState
from drake_tracker.vision.silhouettes.regions import Region
from drake_tracker.vision.silhouettes.stereo_geometry import projection_jacobian
from drake_tracker.vision.silhouettes.track_3d import COLOUR_WEIGHT, GUESSED, HEIGHT_KNOWN, Track3D

RECENTLY, NEARBY = 1.0, 0.3
"""Time since two objects were merged [s], and distance between them [m], up to which their identities are checked."""
WRONG_SIZE_TIME = 4.0
"""Time [s] for which an object without others near it can have a silhouette that is too large for it."""
CLEAR_COLOUR = 60.0
"""By how much the colours of two objects must fit better to the identities exchanged [grey levels, all channels]."""


def learn_look(
    track: Track3D, cameras: Sequence[CameraModel], regions: Sequence[Region | None], p_WQ: np.ndarray
) -> Track3D:
    """Returns the track with the extents and colour of its regions, unless other objects cover a part of them."""
    stereo = track.stereo
    weight = max(COLOUR_WEIGHT, 1.0 / (stereo + 1))
    (red, green, blue), height, merged = track.colour, track.height, track.merged
    alone, guessed_until, heights = track.alone, track.guessed_until, track.heights
    if any(region is None or not region.whole for region in regions):
        merged = track.stamp
    elif regions[0] is not None:
        stereo, guessed_until = stereo + 1, -np.inf
        height += weight * (p_WQ[2] - height)
        if track.stereo >= HEIGHT_KNOWN:
            low, high = (np.inf, -np.inf) if heights == GUESSED else heights
            heights = min(low, float(height)), max(high, float(height))
        red, green, blue = (old + weight * (new - old) for old, new in zip(track.colour, regions[0].colour))
    shape = track.shape.turned(track.mean[3:])
    # A silhouette that looks too large for one object may only lie in another direction.
    stands = track.state == TrackState.STANDING and shape.settled
    if stands and all(region is not None and not (region.covered or region.cut) for region in regions):
        whole = [region for region in regions if region is not None]
        shape = shape.at_rest(
            np.array([projection_jacobian(camera, track.position) for camera in cameras]),
            np.array([region.extents for region in whole]),
            np.array([region.slant for region in whole]),
        )
    views = [
        (projection_jacobian(camera, track.position), region)
        for camera, region in zip(cameras, regions)
        if region is not None and region.whole
    ]
    if views:
        alone = track.stamp
        if track.height_known:
            guessed_until = -np.inf
        shape = shape.learned(
            np.array([J for J, _ in views]),
            np.array([region.extents for _, region in views]),
            np.array([region.pixels for _, region in views]),
        )
    return replace(
        track,
        shape=shape,
        height=float(height),
        heights=heights,
        colour=(red, green, blue),
        stereo=stereo,
        merged=merged,
        alone=alone,
        guessed_until=guessed_until,
    )


def relearning(track: Track3D, tracks: Sequence[Track3D]) -> Track3D:
    """Returns a track, whose size is learned anew if its silhouettes are too large for long without another object.

    The size of such an object was learned from a partial view.
    """
    if track.stamp - track.alone < WRONG_SIZE_TIME or not track.shape.settled:
        return track
    near = (np.linalg.norm(other.position - track.position) < NEARBY for other in tracks if other is not track)
    return track if any(near) else replace(track, shape=replace(track.shape, count=0), alone=track.stamp)


def recognised(tracks: Sequence[Track3D], found: Sequence[Sequence[Region]]) -> list[Track3D]:
    """Returns the tracks, with the identities of two exchanged whose colours say so when they have just separated.

    While the silhouettes of two objects are merged in both images, positions do not always tell which is which.
    """
    tracks = list(tracks)
    alone = [k for k, track in enumerate(tracks) if track.number and is_alone(track, found)]
    for i in alone:
        for j in alone:
            one, other = tracks[i], tracks[j]
            recent = one.stamp - max(one.merged, other.merged) < RECENTLY
            near = float(np.linalg.norm(one.position - other.position)) < NEARBY
            if i < j and recent and near:
                colours = [np.array(found[0][track.places[0]].colour) for track in (one, other)]
                known = [np.array(track.colour) for track in (one, other)]
                same = sum(np.abs(a - b).sum() for a, b in zip(colours, known))
                exchanged = sum(np.abs(a - b).sum() for a, b in zip(colours, reversed(known)))
                if exchanged + CLEAR_COLOUR < same:
                    tracks[i], tracks[j] = one.as_object_of(other), other.as_object_of(one)
    return tracks


def is_alone(track: Track3D, found: Sequence[Sequence[Region]]) -> bool:
    """Returns whether a track is measured in both images with silhouettes that show its object only."""
    return min(track.places) >= 0 and all(found[side][place].whole for side, place in enumerate(track.places))
