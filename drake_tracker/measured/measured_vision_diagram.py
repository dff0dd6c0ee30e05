"""Vision without images: the Systems that read the truth, the faults of their points, and the lag."""

from collections.abc import Sequence

from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.measured_tracks_system import MeasuredTracksSystem


class MeasuredVisionDiagram(Diagram):
    """Takes the place of cameras and image processing in a scenario with ``vision: !Measured``.

    .. pydrake_system::

        name: MeasuredVisionDiagram
        input_ports:
        - truth_train_state
        output_ports:
        - point

    The inputs are the inputs of the sources: ``truth_train_state``, ``truth_object_states`` with further objects,
    ``truth_part_states`` for the parts on a belt. The outputs are the outputs of the only source, or of ``tracking``:
    ``point``, ``tracks`` or ``parts``. Each output is the vector of ``lag_cycles`` cycles ago, with its capture time as
    stamp, sampled every ``period`` at offset 0 in the slot of rendered vision; all zeros before. With 0 cycles it is
    the vector of the present cycle, which no camera can deliver.

    Unlike cameras, measured vision is not blinded when the hand comes between, sees the object where it hangs in the
    hand, and never confuses two objects. As the error was measured with a motion detector, it does not see an object
    below a certain speed.

    Args:
        sources: the Systems that read the truth: a `MeasuredErrorSystem` for each object, or a `MeasuredPartsSystem`.
        lag_cycles: cycles from capture to output, 0 or more.
        tracking: makes tracks from the points of all sources; None: there is one source.
        faults: for each source a System with input and output ``point`` that changes its points; empty: none.
        period: of a cycle [s].
    """

    def __init__(
        self,
        sources: Sequence[System],
        lag_cycles: int,
        *,
        tracking: MeasuredTracksSystem | None = None,
        faults: Sequence[System] = (),
        period: float = VISION_PERIOD,
    ) -> None:
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        if tracking is not None:
            builder.AddNamedSystem("tracker", tracking)
        inputs: set[str] = set()
        for number, source in enumerate(sources):
            builder.AddNamedSystem(f"measured_{number}", source)
            truth, seen = source.get_input_port(), source.get_output_port()
            if truth.get_name() in inputs:
                builder.ConnectInput(truth.get_name(), truth)
            else:
                builder.ExportInput(truth, truth.get_name())
            inputs.add(truth.get_name())
            if faults:
                builder.AddNamedSystem(f"faults_{number}", faults[number])
                builder.Connect(seen, faults[number].get_input_port())
                seen = faults[number].get_output_port()
            if tracking is not None:
                builder.Connect(seen, tracking.GetInputPort(f"point_{number}"))
        outputs = [seen] if tracking is None else [tracking.get_output_port(k) for k in range(2)]
        for port in outputs:
            lag = builder.AddNamedSystem(f"lag_{port.get_name()}", DiscreteTimeDelay(period, lag_cycles, port.size()))
            builder.Connect(port, lag.get_input_port())
            builder.ExportOutput(lag.get_output_port(), port.get_name())
        builder.BuildInto(self)
