"""The pick machine as a System."""

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.messages import (
    ArmCommand,
    JawState,
    OperatorCommand,
    PickDiagnosis,
    PickOrder,
    Prediction,
    ServoTarget,
    ToolStatus,
    message_size,
)
from drake_tracker.core.timing import GRASP_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot
from drake_tracker.grasp.pick_machine import PickMachine, PickObservation, PickState


class PickSystem(LeafSystem):
    """Decides what a hand that carries out orders does next, and listens to the operator.

    .. pydrake_system::

        name: PickSystem
        input_ports:
        - target
        - packet
        - order
        - jaws
        - status
        - operator
        output_ports:
        - command
        - diagnosis
        - goal

    - ``target``: a `ServoTarget`. All zeros, hence not valid: no part.
    - ``packet``: the `Prediction` on which the target rests. All zeros: none.
    - ``order``: the newest `PickOrder` on the link. All zeros: none.
    - ``jaws``: a `JawState`; it is always valid.
    - ``status``: a `ToolStatus`; it is always valid.
    - ``operator``: an `OperatorCommand`. All zeros, or left unconnected: the operator only supervises.
    - ``command``: an `ArmCommand`, which is never all zeros.
    - ``diagnosis``: a `PickDiagnosis`.
    - ``goal``: a `ServoTarget` at rest where the hand goes in the frame `MotionFrame.GOAL`.

    All outputs are state, updated every period in the slot of the grasp machine, which follows that of the servo.

    Args:
        machine: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, machine: PickMachine, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
        super().__init__()
        self._machine = machine
        self._target = self.DeclareVectorInputPort("target", message_size(ServoTarget))
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._order = self.DeclareVectorInputPort("order", message_size(PickOrder))
        self._jaws = self.DeclareVectorInputPort("jaws", message_size(JawState))
        self._status = self.DeclareVectorInputPort("status", message_size(ToolStatus))
        self._operator = self.DeclareVectorInputPort("operator", message_size(OperatorCommand))
        self._state = self.DeclareAbstractState(AbstractValue.Make(machine.initial_state()))
        from_state = {self.abstract_state_ticket(self._state)}
        self.DeclareVectorOutputPort("command", message_size(ArmCommand), self._calc_command, from_state)
        self.DeclareVectorOutputPort("diagnosis", message_size(PickDiagnosis), self._calc_diagnosis, from_state)
        self.DeclareVectorOutputPort("goal", message_size(ServoTarget), self._calc_goal, from_state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(GRASP_SLOT, time_step, period), self._update)

    def _update(self, context: Context, state: State) -> None:
        connected = self._operator.HasValue(context)
        operator = self._operator.Eval(context) if connected else np.zeros(message_size(OperatorCommand))
        seen = PickObservation(
            time=context.get_time(),
            target=ServoTarget(self._target.Eval(context)),
            packet=np.array(self._packet.Eval(context)),
            order=PickOrder(np.array(self._order.Eval(context))),
            jaws=JawState(self._jaws.Eval(context)),
            status=ToolStatus(self._status.Eval(context)),
            operator=OperatorCommand(np.array(operator)),
        )
        new = self._machine.update(self._value(context), seen)
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_command(self, context: Context, output: Any) -> None:
        output.SetFromVector(self._machine.command(self._value(context)))

    def _calc_diagnosis(self, context: Context, output: Any) -> None:
        state = self._value(context)
        working = PickOrder(state.order).job if PickOrder(state.order).job > state.done else 0.0
        counts = [state.attempts, state.picked, state.placed, state.failed]
        output.SetFromVector([state.phase, working, state.done, *counts, state.gate, state.p_success])

    def _calc_goal(self, context: Context, output: Any) -> None:
        output.SetFromVector(self._machine.goal_target(self._value(context)))

    def _value(self, context: Context) -> PickState:
        return context.get_abstract_state(int(self._state)).get_value()
