"""The tracker as a Drake System: segmented images of two cameras in, tracks and the point of the target out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.constants import SIDES
from drake_tracker.core.frozen_state import FrozenState, declare_outputs
from drake_tracker.core.messages import (
    EXPECTED_FIELDS,
    REGION_FIELDS,
    REGION_SLOTS,
    TRACK_FIELDS,
    Centroid,
    Regions,
    TrackPoint,
    TrackPoints,
    TrackPredictions,
    message_rows,
    message_size,
)
from drake_tracker.core.timing import PROJECTOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.vision.camera_motion import Verdict
from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.regions import Region
from drake_tracker.vision.silhouettes.target import Reason, choose_target, make_target_rule, reason_of
from drake_tracker.vision.silhouettes.track_3d import Track3D
from drake_tracker.vision.silhouettes.tracker import Expected, Tracker, TrackerState

_UPPER = np.triu_indices(3)


@dataclass(frozen=True, eq=False)
class TrackerMemory(FrozenState):
    """State of a `TrackerSystem`.

    Attributes:
        tracker: state of the tracker.
        target: number of the track that is followed, 0 without one.
    """

    tracker: TrackerState
    target: int


class TrackerSystem(LeafSystem):
    """Tracks the objects in the images of two cameras, and measures the target.

    .. pydrake_system::

        name: TrackerSystem
        input_ports:
        - foreground_left
        - foreground_right
        - expected
        - selected
        output_ports:
        - point
        - tracks
        - regions_left
        - regions_right
        - centroid_left
        - centroid_right

    ``foreground_*``: a `Foreground` each, or None; read every ``period`` at ``offset`` in an unrestricted update.
    ``expected``: a `TrackPredictions` vector of the host, which tells where to look for an object that is not seen; it
    may stay unconnected. ``selected``: number of the track that the operator selected as the target, 0 for none. The
    number of a track that does not exist has no effect. A selected target is kept until its track is deleted or another
    one is selected. Unconnected: nothing is selected.

    ``point`` is a `TrackPoint` of the target in W [m], invalid when the target is not seen. ``tracks`` is a
    `TrackPoints` vector of all confirmed tracks; its ``reason`` says why the point is invalid. ``regions_*`` is a
    `Regions` vector [px] of the images, and ``centroid_*`` a `Centroid` of the target in them. All are zeros before the
    first pair of images.

    Args:
        tracker: the `Tracker`.
        target: a `TargetRule`, or the settings of one, such as `First`.
        period: of the update [s].
        offset: of the update [s].
        stamp_tolerance: largest difference of the two stamps [s].

    Raises DrakeTrackerError when the target is neither, or one of its settings cannot be used.
    """

    def __init__(
        self,
        tracker: Tracker,
        target: Any,
        *,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(PROJECTOR_SLOT),
        stamp_tolerance: float = 1e-9,
    ) -> None:
        super().__init__()
        self._tracker, self._rule = tracker, make_target_rule(target)
        self._stamp_tolerance = stamp_tolerance
        self._foregrounds = [
            self.DeclareAbstractInputPort(f"foreground_{side}", AbstractValue.Make(object())) for side in SIDES
        ]
        self._expected = self.DeclareVectorInputPort("expected", message_size(TrackPredictions))
        self._selected = self.DeclareVectorInputPort("selected", 1)
        state = self.DeclareAbstractState(AbstractValue.Make(TrackerMemory(TrackerState(), 0)))
        outputs: dict[str, tuple[Any, Any]] = {
            "point": (TrackPoint, lambda memory: pack_point(memory.tracker, memory.target)),
            "tracks": (TrackPoints, lambda memory: pack_tracks(memory.tracker, memory.target, self._rule.reason)),
        }
        for k, side in enumerate(SIDES):
            outputs[f"regions_{side}"] = Regions, lambda memory, k=k: pack_regions(memory.tracker, k)
            outputs[f"centroid_{side}"] = Centroid, lambda memory, k=k: pack_centroid(memory.tracker, memory.target, k)
        declare_outputs(self, state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        left, right = (port.Eval(context) for port in self._foregrounds)
        memory: TrackerMemory = context.get_abstract_state(0).get_value()
        if not isinstance(left, Foreground) or not isinstance(right, Foreground):
            return
        if abs(left.stamp - right.stamp) > self._stamp_tolerance or left.stamp <= memory.tracker.stamp:
            return
        expected: dict[int, Expected] = {}
        if self._expected.HasValue(context):
            expected = unpack_expected(self._expected.Eval(context), 0.5 * (left.stamp + right.stamp))
        tracker = self._tracker.update(memory.tracker, (left, right), expected)
        selected = int(self._selected.Eval(context)[0]) if self._selected.HasValue(context) else 0
        target = choose_target(self._rule, tracker.confirmed(), memory.target, selected)
        state.get_mutable_abstract_state(0).set_value(TrackerMemory(tracker, target))


def unpack_expected(message: np.ndarray, stamp: float) -> dict[int, Expected]:
    """Returns {number of a track: expected state at a stamp [s]}, from a message."""
    found = {}
    for number, x, y, z, vx, vy, vz, std in message_rows(message, EXPECTED_FIELDS):
        if number > 0.0:
            step, v_WQ = stamp - TrackPredictions(message).time, np.array([vx, vy, vz])
            found[int(number)] = Expected(np.array([x, y, z]) + step * v_WQ, v_WQ, float(std))
    return found


def pack_point(state: TrackerState, target: int) -> np.ndarray:
    """Returns the `TrackPoint` vector of the target."""
    point = TrackPoint(np.zeros(message_size(TrackPoint)))
    if np.isfinite(state.stamp):
        point.stamp = state.stamp
        track = _track_of(state, target)
        if track is not None and track.measurement is not None:
            point.x, point.y, point.z = track.measurement.p_WQ
            point.gap, point.valid = track.measurement.gap, 1.0
    return np.array(point[:])


def pack_tracks(state: TrackerState, target: int, no_target: Reason = Reason.NO_MATCH) -> np.ndarray:
    """Returns the `TrackPoints` vector of all confirmed tracks.

    Args:
        state: all tracks.
        target: number of the target, 0 without one.
        no_target: why there is no target although there are tracks.
    """
    message = np.zeros(message_size(TrackPoints))
    if not np.isfinite(state.stamp):
        return message
    tracks = state.confirmed()
    header = TrackPoints(message)
    header.stamp, header.target, header.overflow, header.valid = state.stamp, target, state.overflow, 1.0
    header.reason = reason_of(_track_of(state, target), bool(tracks), state.usable, no_target)
    for row, track in zip(message_rows(message, TRACK_FIELDS), tracks):
        measured = track.measurement
        p_WQ, covariance = (
            (track.position, track.covariance[:3, :3]) if measured is None else (measured.p_WQ, measured.covariance)
        )
        gap = 0.0 if measured is None else measured.gap
        row[:] = [
            *(track.number, track.state, *p_WQ, *covariance[_UPPER], *track.mean[3:], gap, track.seen),
            *(track.shape.dimensions.max(), *track.colour),
            *(track.shape.heading, float(track.shape.resting)),
        ]
    return message


def pack_regions(state: TrackerState, side: int) -> np.ndarray:
    """Returns the `Regions` vector of the left (0) or the right image (1)."""
    message = np.zeros(message_size(Regions))
    if np.isfinite(state.stamp):
        regions = state.regions[side]
        header = Regions(message)
        header.stamp, header.count, header.usable = state.stamp, len(regions), float(state.usable)
        verdict, header.displacement = state.cameras[side]
        header.camera = list(Verdict).index(verdict)
        for row, region in zip(message_rows(message, REGION_FIELDS), regions[:REGION_SLOTS]):
            row[:] = [getattr(region, field) for field in REGION_FIELDS]
    return message


def pack_centroid(state: TrackerState, target: int, side: int) -> np.ndarray:
    """Returns the `Centroid` vector of the target in the left (0) or the right image (1)."""
    centroid = np.zeros(message_size(Centroid))
    if np.isfinite(state.stamp):
        centroid[0] = state.stamp
        track = _track_of(state, target)
        if track is not None and track.places[side] >= 0:
            region: Region = state.regions[side][track.places[side]]
            centroid[1:] = region.u, region.v, region.pixels, 1.0
    return centroid


def _track_of(state: TrackerState, number: int) -> Track3D | None:
    return next((track for track in state.confirmed() if track.number == number), None)
