"""The tracks of measured vision as a System."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.frozen_state import FrozenState, declare_outputs
from drake_tracker.core.messages import TrackPoint, TrackPoints, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.measured_tracks import MeasuredTracker, MeasuredTracks
from drake_tracker.vision.silhouettes.target import choose_target, make_target_rule
from drake_tracker.vision.silhouettes.tracker_system import pack_point, pack_tracks


@dataclass(frozen=True, eq=False)
class _Memory(FrozenState):
    """The state of a `MeasuredTracksSystem`.

    Attributes:
        tracks: the tracks.
        target: number of the track that is followed, 0 without one.
    """

    tracks: MeasuredTracks
    target: int


class MeasuredTracksSystem(LeafSystem):
    """Tracks the objects of measured vision, and chooses the target. It reads no ground truth.

    .. pydrake_system::

        name: MeasuredTracksSystem
        input_ports:
        - point_0
        - point_1
        output_ports:
        - point
        - tracks

    ``point_0``, ``point_1`` and so on are a `TrackPoint` vector of each object, read every ``period`` at offset 0 in an
    unrestricted update. ``point`` is the point of the target, invalid while the target is not seen; ``tracks`` is a
    `TrackPoints` vector. Both are without the lag. All are zeros before the first points.

    Args:
        tracker: the `MeasuredTracker`.
        count: number of objects.
        target: a `TargetRule`, or the settings of one, such as `First`.
        period: of a cycle [s].

    Raises DrakeTrackerError when the target is neither, or one of its settings cannot be used.
    """

    def __init__(self, tracker: MeasuredTracker, count: int, target: Any, *, period: float = VISION_PERIOD) -> None:
        super().__init__()
        self._tracker, self._rule = tracker, make_target_rule(target)
        self._points = [self.DeclareVectorInputPort(f"point_{k}", message_size(TrackPoint)) for k in range(count)]
        state = self.DeclareAbstractState(AbstractValue.Make(_Memory(MeasuredTracks(), 0)))
        outputs = {"point": (TrackPoint, self._point), "tracks": (TrackPoints, self._tracks)}
        declare_outputs(self, state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        memory: _Memory = context.get_abstract_state(0).get_value()
        points = [port.Eval(context) for port in self._points]
        if not TrackPoint(points[0]).stamp > max(memory.tracks.stamp, 0.0):
            return
        tracks = self._tracker.update(memory.tracks, points)
        target = choose_target(self._rule, tracks.as_state().confirmed(), memory.target)
        state.get_mutable_abstract_state(0).set_value(_Memory(tracks, target))

    def _point(self, memory: _Memory) -> np.ndarray:
        return pack_point(memory.tracks.as_state(), memory.target)

    def _tracks(self, memory: _Memory) -> np.ndarray:
        return pack_tracks(memory.tracks.as_state(), memory.target, self._rule.reason)
