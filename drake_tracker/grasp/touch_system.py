"""Touching the board as a System."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import ArmCommand, ServoTarget, ToolStatus, TouchReport, message_size
from drake_tracker.core.timing import GRASP_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot


class TouchSystem(LeafSystem):
    """Touches three marks one after the other, and says where they are.

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

    ``status`` is a `ToolStatus`, ``arm_state`` (q, v) the measured joints, ``arm_effort`` the drives' torques [N m],
    ``desired_acceleration`` [rad/s^2] the commanded one. ``target`` is a `ServoTarget` that stands over the mark,
    ``command`` an `ArmCommand`, ``report`` a `TouchReport`. Updates every period in the slot of the grasp machine,
    whose place it takes; all outputs are state.
    """

    def __init__(self, machine, time_step=TIME_STEP, period=SERVO_PERIOD):
        super().__init__()
        self._machine = machine
        n = self._n = machine.model.num_joints
        self._status = self.DeclareVectorInputPort("status", message_size(ToolStatus))
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * n)
        self._effort = self.DeclareVectorInputPort("arm_effort", n)
        self._acceleration = self.DeclareVectorInputPort("desired_acceleration", n)
        self._state = self.DeclareAbstractState(AbstractValue.Make(machine.initial_state()))
        from_state = {self.abstract_state_ticket(self._state)}
        self.DeclareVectorOutputPort(
            "target", message_size(ServoTarget), self._calc_target, from_state | {self.time_ticket()}
        )
        self.DeclareVectorOutputPort("command", message_size(ArmCommand), self._calc_command, from_state)
        self.DeclareVectorOutputPort("report", message_size(TouchReport), self._calc_report, from_state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(GRASP_SLOT, time_step, period), self._update)

    def _update(self, context, state):
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

    def _calc_target(self, context, output):
        output.SetFromVector(self._machine.target(self._value(context), context.get_time()))

    def _calc_command(self, context, output):
        output.SetFromVector(self._machine.command(self._value(context)))

    def _calc_report(self, context, output):
        output.SetFromVector(self._machine.report(self._value(context)))

    def _value(self, context):
        return context.get_abstract_state(int(self._state)).get_value()
