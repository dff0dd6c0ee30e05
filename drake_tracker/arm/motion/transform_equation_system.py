"""The transform equation as a System."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.arm.arm_model import ArmModel, tool_down, tool_yaw
from drake_tracker.arm.motion.tool_motion import MotionFrame, ToolMotion, ToolMotionState
from drake_tracker.core.messages import ArmCommand, ServoTarget, ToolStatus, message_size
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP, TRANSFORM_SLOT, servo_slot


class TransformEquationSystem(LeafSystem):
    """Solves the transform equation for the pose of the tool every servo period.

    .. pydrake_system::

        name: TransformEquationSystem
        input_ports:
        - target
        - command
        - q_commanded
        - goal
        output_ports:
        - X_WT_desired
        - status

    - ``target``: a `ServoTarget` (Obj). All zeros, hence not valid: the hand stays where it is or goes home.
    - ``command``: an `ArmCommand` (Grasp, and the motion to make).
    - ``q_commanded``: the last joint set-points, n values [rad], of which the last, joint 6, decides the jaws' branch.
    - ``goal``: a `ServoTarget` at rest that replaces the target in the frame `MotionFrame.GOAL`; may be unconnected.
    - ``X_WT_desired``: the desired pose of the tool at the ``time`` of the target, a RigidTransform.
    - ``status``: a `ToolStatus`, which is never all zeros.

    Both outputs are state, updated every period in the slot of the transform equation; only ``flipping`` also depends
    on the time.

    Args:
        motion: the arithmetic.
        model: the arm.
        q_initial: joint positions at the start, shape (n,) [rad].
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(
        self,
        motion: ToolMotion,
        model: ArmModel,
        q_initial: Sequence[float] | np.ndarray,
        time_step: float = TIME_STEP,
        period: float = SERVO_PERIOD,
    ) -> None:
        super().__init__()
        self._motion = motion
        X_WT = model.tool_pose(q_initial)
        initial = motion.initial_state(X_WT.translation(), tool_yaw(X_WT))
        self._target = self.DeclareVectorInputPort("target", message_size(ServoTarget))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._q_commanded = self.DeclareVectorInputPort("q_commanded", model.num_joints)
        self._goal = self.DeclareVectorInputPort("goal", message_size(ServoTarget))
        self._state = self.DeclareAbstractState(AbstractValue.Make(initial))
        from_state = {self.abstract_state_ticket(self._state)}
        self.DeclareAbstractOutputPort(
            "X_WT_desired", lambda: AbstractValue.Make(RigidTransform()), self._calc_pose, from_state
        )
        self.DeclareVectorOutputPort(
            "status", message_size(ToolStatus), self._calc_status, from_state | {self.time_ticket()}
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(TRANSFORM_SLOT, time_step, period), self._update)

    def _update(self, context: Context, state: State) -> None:
        command = ArmCommand(self._command.Eval(context))
        has_goal = command.frame == MotionFrame.GOAL and self._goal.HasValue(context)
        target = ServoTarget((self._goal if has_goal else self._target).Eval(context))
        q6 = self._q_commanded.Eval(context)[-1]
        new = self._motion.update(self._value(context), context.get_time(), command, target, q6)
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_pose(self, context: Context, output: Any) -> None:
        tool = self._value(context).tool
        output.set_value(tool_down(tool[:3], tool[3]))

    def _calc_status(self, context: Context, output: Any) -> None:
        state = self._value(context)
        flipping = self._motion.flipping(state, context.get_time())
        output.SetFromVector(
            np.concatenate([[state.motion, state.fraction, float(flipping)], state.tool, [state.branch]])
        )

    def _value(self, context: Context) -> ToolMotionState:
        return context.get_abstract_state(int(self._state)).get_value()
