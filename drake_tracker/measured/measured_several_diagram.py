"""The stand-in for a vision of several objects, as a Diagram: no image is rendered or processed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem, State, System
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import TrackPoint, TrackPoints, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.measured.measured_error import MeasuredError
from drake_tracker.measured.measured_tracks import MeasuredTracker, MeasuredTracks, ObjectLook
from drake_tracker.measured.measured_vision_system import OBJECTS_PORT, TRUTH_PORT, MeasuredErrorSystem
from drake_tracker.vision.silhouettes.target import choose_target, make_target_rule
from drake_tracker.vision.silhouettes.tracker_system import pack_point, pack_tracks


class MeasuredSeveralDiagram(Diagram):
    """Takes the place of `SeveralVisionDiagram` in a scenario with ``vision: !Measured``.

    .. pydrake_system::

        name: MeasuredSeveralDiagram
        input_ports:
        - truth_train_state
        - truth_object_states
        output_ports:
        - point
        - tracks

    The inputs are those of `MeasuredErrorSystem`; ``truth_object_states`` exists only with further objects.
    ``point`` is the `TrackPoint` of the target and ``tracks`` a `TrackPoints` vector, both of ``lag_cycles`` cycles
    ago, sampled every ``period`` at offset 0; all zeros before.

    Each object has the measured error of the train, with random numbers of its own. Unlike the cameras, measured vision
    never confuses two objects and sees through the arm. As it was measured with a motion detector, it does not see an
    object below a certain speed, whose track is deleted after ``coast_time``.

    Args:
        error: `MeasuredError`.
        settings: `SeveralObjects`.
        looks: size and colour of the first train and of all further objects.
        lag_cycles: cycles from capture to output, 0 or more.
        work_volume: lower and upper corner in W, shape (2, 3) [m].
        seed: of all random numbers.
        period: of a cycle [s].
        faults: for each object a System with input and output ``point`` that changes its points; empty: none.
    """

    def __init__(
        self,
        error: MeasuredError,
        settings: SeveralObjects,
        looks: Sequence[ObjectLook],
        lag_cycles: int,
        work_volume: ArrayLike,
        seed: int,
        *,
        period: float = VISION_PERIOD,
        faults: Sequence[System] = (),
    ) -> None:
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        tracker = MeasuredTracker(error, looks, settings)
        tracking = builder.AddNamedSystem(
            "tracker", MeasuredTracksSystem(tracker, len(looks), settings.target, period=period)
        )
        for number in range(len(looks)):
            system = builder.AddNamedSystem(
                f"measured_error_{number}",
                MeasuredErrorSystem(error, work_volume, seed, period=period, number=number, further=len(looks) - 1),
            )
            if number <= 1:
                name = OBJECTS_PORT if number else TRUTH_PORT
                builder.ExportInput(system.GetInputPort(name), name)
            else:
                builder.ConnectInput(OBJECTS_PORT, system.GetInputPort(OBJECTS_PORT))
            point = system.GetOutputPort("point")
            if faults:
                builder.AddNamedSystem(f"faults_{number}", faults[number])
                builder.Connect(point, faults[number].GetInputPort("point"))
                point = faults[number].GetOutputPort("point")
            builder.Connect(point, tracking.GetInputPort(f"point_{number}"))
        for name in ("point", "tracks"):
            port = tracking.GetOutputPort(name)
            lag = builder.AddNamedSystem(f"lag_{name}", DiscreteTimeDelay(period, lag_cycles, port.size()))
            builder.Connect(port, lag.get_input_port())
            builder.ExportOutput(lag.get_output_port(), name)
        builder.BuildInto(self)


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
    unrestricted update. ``point`` is that of the target, invalid when the target is not seen, and ``tracks`` a
    `TrackPoints` vector, both without the lag. All are zeros before the first points.

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
        ticket = {self.abstract_state_ticket(state)}
        self.DeclareVectorOutputPort("point", message_size(TrackPoint), self._calc_point, ticket)
        self.DeclareVectorOutputPort("tracks", message_size(TrackPoints), self._calc_tracks, ticket)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _memory(self, context: Context) -> _Memory:
        memory: _Memory = context.get_abstract_state(0).get_value()
        return memory

    def _update(self, context: Context, state: State) -> None:
        memory = self._memory(context)
        points = [port.Eval(context) for port in self._points]
        if not TrackPoint(points[0]).stamp > max(memory.tracks.stamp, 0.0):
            return
        tracks = self._tracker.update(memory.tracks, points)
        target = choose_target(self._rule, tracks.as_state().confirmed(), memory.target)
        state.get_mutable_abstract_state(0).set_value(_Memory(tracks, target))

    def _calc_point(self, context: Context, output: BasicVector) -> None:
        memory = self._memory(context)
        output.SetFromVector(pack_point(memory.tracks.as_state(), memory.target))

    def _calc_tracks(self, context: Context, output: BasicVector) -> None:
        memory = self._memory(context)
        output.SetFromVector(pack_tracks(memory.tracks.as_state(), memory.target, self._rule.reason))
