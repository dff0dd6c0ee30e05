"""The stand-in for a vision of several objects, as a Diagram: no image is rendered or processed."""

from collections.abc import Sequence

from numpy.typing import ArrayLike
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.measured_error import MeasuredError
from drake_tracker.measured.measured_tracks import MeasuredTracker, ObjectLook
from drake_tracker.measured.measured_tracks_system import MeasuredTracksSystem
from drake_tracker.measured.measured_vision_system import OBJECTS_PORT, TRUTH_PORT, MeasuredErrorSystem
from drake_tracker.vision.config import Several


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
        settings: `Several`; of these, ``target``, ``confirm_after`` and ``coast_time``.
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
        settings: Several,
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
