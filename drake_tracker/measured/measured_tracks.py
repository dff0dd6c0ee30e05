"""The tracks of several objects from the points of measured vision, one object per point."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import TRACK_SLOTS, TrackPoint, TrackState
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.measured.measured_error import MeasuredError
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.track_3d import STANDING_SPEED, Measurement, Track3D, new_track
from drake_tracker.vision.silhouettes.tracker import TrackerState

UNCONFIRMED_TIME = 0.05
"""Time without a point [s] after which a track that is not yet confirmed is deleted."""


@dataclass(frozen=True)
class ObjectLook:
    """Measured vision's knowledge of an object: the size and the colour of its model.

    Attributes:
        dimensions: length, width and height [m].
        colour: red, green, blue [grey levels].
    """

    dimensions: tuple[float, float, float]
    colour: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class MeasuredTracks(FrozenState):
    """The tracks of all objects.

    Attributes:
        stamp: of the newest points [s].
        tracks: for each object its track, or None.
        next_number: number of the next confirmed track.
    """

    stamp: float = -np.inf
    tracks: tuple[Track3D | None, ...] = ()
    next_number: int = 1

    def as_state(self) -> TrackerState:
        """Returns the confirmed tracks as the state of a `Tracker`, oldest first."""
        confirmed = sorted((each for each in self.tracks if each and each.number), key=lambda each: each.number)
        overflow = max(len(confirmed) - TRACK_SLOTS, 0)
        return TrackerState(self.stamp, tuple(confirmed[:TRACK_SLOTS]), self.next_number, overflow=overflow)


class MeasuredTracker:
    """Tracks objects by their points, each of which is known to belong to one object. All state is with the caller.

    Tracks are confirmed and deleted as in `Tracker`.

    Args:
        error: `MeasuredError` of the points, which gives the standard deviations of the tracks.
        looks: size and colour of each object.
        settings: `SeveralObjects`.
    """

    def __init__(self, error: MeasuredError, looks: Sequence[ObjectLook], settings: SeveralObjects) -> None:
        self._error, self._looks, self._settings = error, tuple(looks), settings

    def update(self, state: MeasuredTracks, points: Sequence[np.ndarray]) -> MeasuredTracks:
        """Returns the state after a cycle.

        Args:
            state: the state before.
            points: a `TrackPoint` vector of each object, all with the same stamp.
        """
        stamp = float(TrackPoint(points[0]).stamp)
        before = state.tracks or (None,) * len(self._looks)
        tracks, number = [], state.next_number
        for track, point, look in zip(before, points, self._looks):
            newest = self._next(track, TrackPoint(point), look, stamp)
            if newest is not None and not newest.number and newest.hits >= self._settings.confirm_after:
                newest, number = replace(newest, number=number), number + 1
            tracks.append(newest)
        return MeasuredTracks(stamp, tuple(tracks), number)

    def _next(self, track: Track3D | None, point: TrackPoint, look: ObjectLook, stamp: float) -> Track3D | None:
        """Returns the track of an object after its point, None without one."""
        if track is None:
            return self._begun(point, look, stamp) if point.valid else None
        track = track.predicted(stamp)
        if point.valid:
            track = track.updated(self._measurement(point, track.mean[3:]))
            return replace(track, state=TrackState.MOVING if track.speed > STANDING_SPEED else TrackState.STANDING)
        if stamp - track.seen > (self._settings.coast_time if track.number else UNCONFIRMED_TIME):
            return None
        return replace(track, state=TrackState.NOT_OBSERVED, misses=track.misses + 1)

    def _begun(self, point: TrackPoint, look: ObjectLook, stamp: float) -> Track3D:
        dimensions = read_only(np.array(look.dimensions))
        shape = ObjectShape(dimensions, 0.0, read_only(np.eye(3)), dimensions)
        return new_track(stamp, self._measurement(point, np.zeros(3)), shape, look.colour)

    def _measurement(self, point: TrackPoint, v_WQ: np.ndarray) -> Measurement:
        """Returns the measurement of a point of an object with the velocity v_WQ, shape (3,) [m/s]."""
        heading, speed = float(np.arctan2(v_WQ[1], v_WQ[0])), float(np.hypot(v_WQ[0], v_WQ[1]))
        p_WQ = np.array([point.x, point.y, point.z])
        return Measurement(p_WQ, self._error.covariance(heading, speed), float(point.gap), 1.0)
