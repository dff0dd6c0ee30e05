"""The catch machine as a System."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import (
    ArmCommand,
    CatchDiagnosis,
    OperatorCommand,
    Prediction,
    ServoTarget,
    ToolStatus,
    message_size,
)
from drake_tracker.core.timing import GRASP_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot
from drake_tracker.grasp.catch_machine import CatchObservation


class CatchSystem(LeafSystem):
    """Decides where the cup goes, and listens to the operator.

    .. pydrake_system::

        name: CatchSystem
        input_ports:
        - target
        - packet
        - status
        - operator
        output_ports:
        - command
        - object
        - diagnosis
        - ready

    ``target`` is the ball's `ServoTarget`, ``packet`` the `Prediction` on which it rests, ``status`` a `ToolStatus`,
    ``operator`` an `OperatorCommand`; left unconnected, nobody intervenes. ``command`` is an `ArmCommand`; ``object`` a
    `ServoTarget` that stands still where the tool is to go, for the transform equation in the place of the ball;
    ``diagnosis`` a `CatchDiagnosis`; ``ready`` 1 while the hand waits in its place. Updates every servo period, one
    slot after the servo. All outputs are state.

    Args:
      machine: a `CatchMachine`.
    """

    def __init__(self, machine, time_step=TIME_STEP, period=SERVO_PERIOD):
        super().__init__()
        self._machine = machine
        self._target = self.DeclareVectorInputPort("target", message_size(ServoTarget))
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._status = self.DeclareVectorInputPort("status", message_size(ToolStatus))
        self._operator = self.DeclareVectorInputPort("operator", message_size(OperatorCommand))
        self._state = self.DeclareAbstractState(AbstractValue.Make(machine.initial_state()))
        from_state = {self.abstract_state_ticket(self._state)}
        self.DeclareVectorOutputPort("command", message_size(ArmCommand), self._calc_command, from_state)
        self.DeclareVectorOutputPort("object", message_size(ServoTarget), self._calc_object, from_state)
        self.DeclareVectorOutputPort("diagnosis", message_size(CatchDiagnosis), self._calc_diagnosis, from_state)
        self.DeclareVectorOutputPort("ready", 1, self._calc_ready, from_state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(GRASP_SLOT, time_step, period), self._update)

    def _update(self, context, state):
        nobody = not self._operator.HasValue(context)
        seen = CatchObservation(
            time=context.get_time(),
            target=ServoTarget(self._target.Eval(context)),
            packet=np.array(self._packet.Eval(context)),
            status=ToolStatus(self._status.Eval(context)),
            operator=np.zeros(message_size(OperatorCommand)) if nobody else np.array(self._operator.Eval(context)),
        )
        new = self._machine.update(self._value(context), seen)
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_command(self, context, output):
        output.SetFromVector(self._machine.command(self._value(context)))

    def _calc_object(self, context, output):
        output.SetFromVector(self._machine.object(self._value(context)))

    def _calc_diagnosis(self, context, output):
        state = self._value(context)
        if state.crossing is None:
            output.SetFromVector([state.phase, 0.0, 0.0, 0.0, 0.0, 0.0, state.motion])
        else:
            x, y = state.crossing.place[:2]
            left = self._machine.time_left(state)
            output.SetFromVector([state.phase, 1.0, left, x, y, state.crossing.std, state.motion])

    def _calc_ready(self, context, output):
        output.SetFromVector([float(self._machine.is_ready(self._value(context)))])

    def _value(self, context):
        return context.get_abstract_state(int(self._state)).get_value()
