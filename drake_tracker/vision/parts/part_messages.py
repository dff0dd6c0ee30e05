"""The messages of a `PartTracker`: the parts for the host, and what pictures and video show of them."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.core.messages import (
    PART_FIELDS,
    PART_SLOTS,
    REGION_FIELDS,
    REGION_SLOTS,
    TRACK_FIELDS,
    TRACK_SLOTS,
    PartTracks,
    Regions,
    TrackPoints,
    message_rows,
    message_size,
)
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.vision.parts.part_silhouette import PartSilhouette
from drake_tracker.vision.parts.part_track import PartTrack
from drake_tracker.vision.parts.part_tracker import PartTrackerState
from drake_tracker.vision.silhouettes.track_3d import TrackState


def reported(state: PartTrackerState, first: float, last: float) -> list[PartTrack]:
    """Returns the confirmed parts between two places along the belt, those farthest downstream first.

    Args:
        state: of the tracker.
        first: smallest y [m].
        last: largest y [m].
    """
    tracks = [track for track in state.tracks if track.number > 0 and first <= track.pose.y <= last]
    return sorted(tracks, key=lambda track: -track.pose.y)


def pack_parts(stamp: float, tracks: Sequence[PartTrack], belt_height: float) -> np.ndarray:
    """Returns the `PartTracks` vector of parts, of the first ones if they are more than the slots.

    Args:
        stamp: of the images [s].
        tracks: the parts.
        belt_height: z_W of the belt's upper face [m].
    """
    message = np.zeros(message_size(PartTracks))
    header = PartTracks(message)
    header.stamp, header.valid = stamp, 1.0
    for row, track in zip(message_rows(message, PART_FIELDS), tracks[:PART_SLOTS]):
        pose, variances = track.pose, np.diag(track.fit.covariance)
        z = belt_height + 0.5 * PART_SHAPES[pose.kind].height
        row[:] = [
            *(track.number, pose.kind, pose.x, pose.y, z, pose.yaw),
            *(variances[1], variances[0], variances[2], track.seen),
        ]
    return message


def pack_part_tracks(stamp: float, tracks: Sequence[PartTrack], belt_height: float, speed: float) -> np.ndarray:
    """Returns the `TrackPoints` vector that shows parts in a video.

    Args:
        stamp: of the images [s].
        tracks: the parts.
        belt_height: z_W of the belt's upper face [m].
        speed: of the belt [m/s].
    """
    message = np.zeros(message_size(TrackPoints))
    header = TrackPoints(message)
    header.stamp, header.valid, header.overflow = stamp, 1.0, max(len(tracks) - TRACK_SLOTS, 0)
    for row, track in zip(message_rows(message, TRACK_FIELDS), tracks):
        shape, pose = PART_SHAPES[track.pose.kind], track.pose
        state = TrackState.MOVING if track.seen >= stamp else TrackState.NOT_OBSERVED
        values = {
            "number": track.number, "state": state, "x": pose.x, "y": pose.y, "z": belt_height + 0.5 * shape.height,
            "vy": speed, "seen": track.seen, "size": shape.length,
        }  # fmt: skip
        row[:] = [values.get(field, 0.0) for field in TRACK_FIELDS]
    return message


def pack_part_regions(
    stamp: float, tracks: Sequence[PartTrack], silhouette: PartSilhouette, offset: tuple[int, int]
) -> np.ndarray:
    """Returns the `Regions` vector with the upright rectangle around each part that is seen in an image.

    Args:
        stamp: of the image [s].
        tracks: the parts.
        silhouette: draws them in the image.
        offset: (u0, v0) of the first pixel of the image in the full image [px].
    """
    message = np.zeros(message_size(Regions))
    seen = [track for track in tracks if track.seen >= stamp]
    header = Regions(message)
    header.stamp, header.count, header.usable = stamp, len(seen), 1.0
    for row, track in zip(message_rows(message, REGION_FIELDS), seen[:REGION_SLOTS]):
        corners = np.concatenate(silhouette.outlines(track.pose)) + offset
        (u, v), (width, height) = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)
        values = {"u": u, "v": v, "width": width, "height": height, "share": track.fit.share, "track": track.number}
        row[:] = [values.get(field, 0.0) for field in REGION_FIELDS]
    return message
