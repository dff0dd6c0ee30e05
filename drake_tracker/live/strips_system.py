"""Samples the values that the strips of the live view show, as a Drake System."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, State

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import ArmCommand, Filtered, Prediction, TrackPoint, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.strips import StripChart, StripInputs

SAMPLE_PERIOD = 3 * VISION_PERIOD
"""Simulated time [s] between two samples: 20 a second."""
OPTIONAL = ("point", "filtered")
"""Signals that only the host of a single object has."""
_STATE_SIZE = 13
"""Elements of a free body's state."""
_POSITION = slice(4, 7)
"""Position of a free body in its state, after the quaternion."""


@dataclass(frozen=True)
class _Points(FrozenState):
    """The newest valid points.

    Attributes:
        points: `TrackPoint` messages, at most two, older first.
    """

    points: tuple[Any, ...] = ()


class StripsSystem(LeafSystem):
    """Passes a sample of the strips' values to the live view every `SAMPLE_PERIOD`.

    .. pydrake_system::

        name: StripsSystem
        input_ports:
        - point
        - filtered
        - accepted
        - command
        - arm_state
        - truth_train_state
        - jaws

    Every port is a vector: ``point`` is a `TrackPoint`, ``filtered`` a `Filtered`, ``accepted`` the `Prediction` that
    the arm follows, ``command`` an `ArmCommand`, ``arm_state`` positions [rad] and velocities [rad/s] of the joints.
    The last two are named by the `StripChart`: the true state of the object or of several objects (13 elements each, SI
    units, in W) and the task's own message; the block shows those of the train. ``point`` and ``filtered`` may be left
    unconnected, for a diagram that has none.

    The samples are published every 1/20 s with offset 0. An unrestricted update every vision period (1/60 s) with
    offset 0 keeps the two newest valid points. There are no output ports: the System reads ground truth and feeds
    nothing back into the loop.
    """

    def __init__(
        self, chart: StripChart, model: Any, add_sample: Callable[[tuple[Any, ...]], object], objects: int = 1
    ) -> None:
        """Creates the System.

        Args:
            chart: the strips of the task.
            model: `ArmModel` used for the tool position; one of its own, or the arm's.
            add_sample: called with (simulated time [s], number of the phase, *values of the strips).
            objects: number of objects whose states are read.
        """
        super().__init__()
        self._chart, self._model, self._add_sample = chart, model, add_sample
        sizes = {
            "point": message_size(TrackPoint),
            "filtered": message_size(Filtered),
            "accepted": message_size(Prediction),
            "command": message_size(ArmCommand),
            "arm_state": 2 * model.num_joints,
            chart.state_port: _STATE_SIZE * objects,
            chart.report_port: message_size(chart.report_view),
        }
        self._ports = {name: self.DeclareVectorInputPort(name, size) for name, size in sizes.items()}
        self._points = self.DeclareAbstractState(AbstractValue.Make(_Points()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(VISION_PERIOD, 0.0, self._remember_points)
        self.DeclarePeriodicPublishEvent(SAMPLE_PERIOD, 0.0, self._publish_sample)

    def _remember_points(self, context: Context, state: State) -> None:
        points = self._newest_points(context)
        state.get_mutable_abstract_state(self._points).set_value(_Points(points))

    def _newest_points(self, context: Context) -> tuple[Any, ...]:
        """Returns the two newest valid points, the present one included."""
        points = context.get_abstract_state(self._points).get_value().points
        point = TrackPoint(self._read("point", context))
        if point.valid and not (points and points[-1].stamp == point.stamp):
            points = (*points[-1:], point)
        return points

    def _publish_sample(self, context: Context) -> None:
        read = {name: self._read(name, context) for name in self._ports}
        command = ArmCommand(read["command"])
        states = read[self._chart.state_port].reshape(-1, _STATE_SIZE)
        q = read["arm_state"][: self._model.num_joints]
        inputs = StripInputs(
            now=context.get_time(),
            p_WT=self._model.tool_pose(q).translation(),
            p_WQ=states[0, _POSITION],
            packet=read["accepted"],
            filtered=Filtered(read["filtered"]),
            command=command,
            points=self._newest_points(context),
            report=self._chart.report_view(read[self._chart.report_port]),
            states=states,
        )
        self._add_sample((round(inputs.now, 4), int(command.phase), *self._chart.values(inputs)))

    def _read(self, name: str, context: Context) -> np.ndarray:
        """Returns the value of an input, zeros where it is not connected."""
        port = self._ports[name]
        return np.array(port.Eval(context)) if port.HasValue(context) else np.zeros(port.size())


def add_strips(
    builder: DiagramBuilder,
    *,
    hand_eye: Diagram,
    chart: StripChart,
    model: Any,
    add_sample: Callable[[tuple[Any, ...]], object],
) -> StripsSystem:
    """Adds a `StripsSystem` and connects it to a `HandEyeDiagram` of the same builder.

    Args:
        builder: receives the System.
        hand_eye: diagram with the output ports that the System reads.
        chart: the strips of the task.
        model: `ArmModel`, as in `StripsSystem`.
        add_sample: as in `StripsSystem`.
    """
    objects = hand_eye.GetOutputPort(chart.state_port).size() // _STATE_SIZE
    system = builder.AddNamedSystem("live_strips", StripsSystem(chart, model, add_sample, objects))
    for k in range(system.num_input_ports()):
        port = system.get_input_port(k)
        if port.get_name() not in OPTIONAL or hand_eye.HasOutputPort(port.get_name()):
            builder.Connect(hand_eye.GetOutputPort(port.get_name()), port)
    return system
