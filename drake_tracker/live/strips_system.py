"""The live view's look at a run, as a Drake System."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import (
    ArmCommand,
    CatchDiagnosis,
    Filtered,
    JawState,
    Prediction,
    TrackPoint,
    message_size,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.live.strips import Sights, measure

SAMPLE_PERIOD = 3 * VISION_PERIOD
"""Simulated time [s] between two samples: 20 a second."""
_POSITION = slice(4, 7)
"""Of a free body's state: after its quaternion."""


@dataclass(frozen=True)
class _Points:
    """The newest valid `TrackPoint`s, at most two, older first."""

    points: tuple = ()

    def __deepcopy__(self, memo):
        return self


class StripsSystem(LeafSystem):
    """Publishes what the strips of the live view show, every `SAMPLE_PERIOD` from time 0.

    .. pydrake_system::

        name: StripsSystem
        input_ports:
        - point
        - filtered
        - delivered
        - command
        - arm_state
        - truth_train_state
        - jaws

    That is the train's; the ball's has ``truth_ball_state`` and ``diagnosis``, a `CatchDiagnosis`, in the place of the
    last two. An unrestricted update keeps the two newest points, each cycle. There are no outputs: it reads truth.

    Args:
      task: "train" or "ball". model: an `ArmModel` of its own, or the arm's. add_sample: called with (time [s], phase's
      number, values of `strips.measure`).
    """

    def __init__(self, task, model, add_sample):
        super().__init__()
        self._model, self._add_sample = model, add_sample
        sizes = {
            "point": message_size(TrackPoint),
            "filtered": message_size(Filtered),
            "delivered": message_size(Prediction),
            "command": message_size(ArmCommand),
            "arm_state": 2 * model.num_joints,
            f"truth_{task}_state": 13,
        }
        self._body = f"truth_{task}_state"
        self._last, self._last_view = ("jaws", JawState) if task == "train" else ("diagnosis", CatchDiagnosis)
        sizes[self._last] = message_size(self._last_view)
        self._ports = {name: self.DeclareVectorInputPort(name, size) for name, size in sizes.items()}
        self._points = self.DeclareAbstractState(AbstractValue.Make(_Points()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(VISION_PERIOD, 0.0, self._remember)
        self.DeclarePeriodicPublishEvent(SAMPLE_PERIOD, 0.0, self._publish)

    def _remember(self, context, state):
        points = self._newest(context)
        state.get_mutable_abstract_state(self._points).set_value(_Points(points))

    def _newest(self, context):
        """Returns the newest valid points, those of this instant among them."""
        points = context.get_abstract_state(self._points).get_value().points
        point = TrackPoint(np.array(self._ports["point"].Eval(context)))
        if point.valid and not (points and points[-1].stamp == point.stamp):
            points = (*points[-1:], point)
        return points

    def _publish(self, context):
        read = {name: port.Eval(context) for name, port in self._ports.items()}
        command = ArmCommand(read["command"])
        q = read["arm_state"][: self._model.num_joints]
        sights = Sights(
            now=context.get_time(),
            p_WT=self._model.tool_pose(q).translation(),
            p_WQ=read[self._body][_POSITION],
            packet=read["delivered"],
            filtered=Filtered(read["filtered"]),
            command=command,
            points=self._newest(context),
            **{self._last: self._last_view(read[self._last])},
        )
        self._add_sample((round(sights.now, 4), int(command.phase), *measure(sights)))


def add_strips(builder, hand_eye, task, model, add_sample):
    """Adds a `StripsSystem` that watches a `HandEyeDiagram`; returns it. Arguments as there."""
    system = builder.AddNamedSystem("live_strips", StripsSystem(task, model, add_sample))
    for k in range(system.num_input_ports()):
        port = system.get_input_port(k)
        builder.Connect(hand_eye.GetOutputPort(port.get_name()), port)
    return system
