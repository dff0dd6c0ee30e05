"""The catch machine as a System."""

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

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
from drake_tracker.grasp.catch_machine import CatchMachine, CatchObservation, CatchState


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

    - ``target``: the ball's `ServoTarget`. All zeros, hence not valid: no ball.
    - ``packet``: the `Prediction` of the ball's path. All zeros: none.
    - ``status``: a `ToolStatus`; it is always valid.
    - ``operator``: an `OperatorCommand`. All zeros, or left unconnected: the operator only supervises.
    - ``command``: an `ArmCommand`.
    - ``object``: a `ServoTarget` that stands still where the tool should go, for the transform equation in the place of
      the ball.
    - ``diagnosis``: a `CatchDiagnosis`.
    - ``ready``: 1 while the hand waits in its place, otherwise 0.

    All outputs are state, updated every period in the slot of the grasp machine, which follows that of the servo.

    Args:
        machine: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, machine: CatchMachine, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
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

    def _update(self, context: Context, state: State) -> None:
        connected = self._operator.HasValue(context)
        operator = self._operator.Eval(context) if connected else np.zeros(message_size(OperatorCommand))
        seen = CatchObservation(
            time=context.get_time(),
            target=ServoTarget(self._target.Eval(context)),
            packet=np.array(self._packet.Eval(context)),
            status=ToolStatus(self._status.Eval(context)),
            operator=OperatorCommand(np.array(operator)),
        )
        new = self._machine.update(self._value(context), seen)
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_command(self, context: Context, output: Any) -> None:
        output.SetFromVector(self._machine.command(self._value(context)))

    def _calc_object(self, context: Context, output: Any) -> None:
        output.SetFromVector(self._machine.goal_target(self._value(context)))

    def _calc_diagnosis(self, context: Context, output: Any) -> None:
        state = self._value(context)
        if state.crossing is None:
            output.SetFromVector([state.phase, 0.0, 0.0, 0.0, 0.0, 0.0, state.motion])
        else:
            x, y = state.crossing.place[:2]
            left = self._machine.time_left(state)
            output.SetFromVector([state.phase, 1.0, left, x, y, state.crossing.std, state.motion])

    def _calc_ready(self, context: Context, output: Any) -> None:
        output.SetFromVector([float(self._machine.is_ready(self._value(context)))])

    def _value(self, context: Context) -> CatchState:
        return context.get_abstract_state(int(self._state)).get_value()
