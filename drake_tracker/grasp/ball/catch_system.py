"""The catch machine as a System."""

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import (
    ArmCommand,
    CatchDiagnosis,
    Prediction,
    ServoTarget,
    ToolStatus,
    TouchReport,
    message_size,
)
from drake_tracker.core.timing import GRASP_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot
from drake_tracker.grasp.ball.catch_machine import CatchMachine, CatchObservation, CatchState
from drake_tracker.grasp.ball.touch_machine import TouchMachine, TouchState
from drake_tracker.grasp.machine_system import MachineSystem


class CatchSystem(MachineSystem):
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
        def diagnosis(state: CatchState) -> list[float]:
            if state.crossing is None:
                return [state.phase, 0.0, 0.0, 0.0, 0.0, 0.0, state.motion]
            x, y = state.crossing.place[:2]
            return [state.phase, 1.0, machine.time_left(state), x, y, state.crossing.std, state.motion]

        inputs = {"target": ServoTarget, "packet": message_size(Prediction), "status": ToolStatus}
        outputs = {
            "command": (ArmCommand, machine.command),
            "object": (ServoTarget, machine.goal_target),
            "diagnosis": (CatchDiagnosis, diagnosis),
            "ready": (1, lambda state: [float(machine.is_ready(state))]),
        }
        super().__init__(machine, CatchObservation, inputs, outputs, time_step, period)


class TouchSystem(LeafSystem):
    """Touches three marks on the board one after the other, and reports where they are.

    .. pydrake_system::

        name: TouchSystem
        input_ports:
        - status
        - arm_state
        - arm_effort
        - desired_acceleration
        output_ports:
        - target
        - command
        - report

    - ``status``: a `ToolStatus`; it is always valid.
    - ``arm_state``: measured joint positions and velocities, 2 n values [rad, rad/s].
    - ``arm_effort``: torques that the joint servos apply, n values [N m].
    - ``desired_acceleration``: commanded joint accelerations, n values [rad/s^2].
    - ``target``: a `ServoTarget` that stands still over the mark; it is always valid.
    - ``command``: an `ArmCommand`.
    - ``report``: a `TouchReport`. The positions of marks that are not touched yet are zero.

    All outputs are state, updated every period in the slot of the grasp machine, whose place this System takes; only
    the times in ``target`` also depend on the time.

    Args:
        machine: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, machine: TouchMachine, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
        super().__init__()
        self._machine = machine
        n = self._n = machine.model.num_joints
        self._status = self.DeclareVectorInputPort("status", message_size(ToolStatus))
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * n)
        self._effort = self.DeclareVectorInputPort("arm_effort", n)
        self._acceleration = self.DeclareVectorInputPort("desired_acceleration", n)
        self._state = self.DeclareAbstractState(AbstractValue.Make(machine.initial_state()))
        tickets = {self.abstract_state_ticket(self._state), self.time_ticket()}
        self.DeclareVectorOutputPort("target", message_size(ServoTarget), self._calc_target, tickets)
        outputs = {"command": (ArmCommand, machine.command), "report": (TouchReport, machine.report)}
        declare_outputs(self, self._state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(GRASP_SLOT, time_step, period), self._update)

    def _update(self, context: Context, state: State) -> None:
        q, v = np.split(np.array(self._arm_state.Eval(context)), [self._n])
        new = self._machine.update(
            self._value(context),
            context.get_time(),
            ToolStatus(self._status.Eval(context)),
            q,
            v,
            self._acceleration.Eval(context),
            self._effort.Eval(context),
        )
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_target(self, context: Context, output: Any) -> None:
        output.SetFromVector(self._machine.target(self._value(context), context.get_time()))

    def _value(self, context: Context) -> TouchState:
        return context.get_abstract_state(int(self._state)).get_value()
