"""The part of the arm's computer that every task shares: from a target and a command to the joint servos."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem, OutputPort, State

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_model import ArmModel, tool_down, tool_yaw
from drake_tracker.arm.motion.differential_ik import limit_acceleration, make_parameters, step_joints
from drake_tracker.arm.motion.set_point_spline_system import (
    SetPointSplineSystem,
    add_joint_feedforward,
    add_set_point_spline,
)
from drake_tracker.arm.motion.tool_motion import MotionFrame, ToolMotion, ToolMotionState
from drake_tracker.arm.safety.collision_reflex_system import CollisionReflexSystem
from drake_tracker.arm.safety.joint_limiter import JointLimiter
from drake_tracker.arm.safety.joint_limiter_system import JointLimiterSystem
from drake_tracker.core.messages import ArmCommand, ServoTarget, ToolStatus, message_size
from drake_tracker.core.timing import IK_SLOT, SERVO_PERIOD, TIME_STEP, TRANSFORM_SLOT, servo_slot


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
        output.set_value(tool_down(tool[:3], tool[3], tool[4:]))

    def _calc_status(self, context: Context, output: Any) -> None:
        state = self._value(context)
        flipping = self._motion.flipping(state, context.get_time())
        output.SetFromVector(
            np.concatenate([[state.motion, state.fraction, float(flipping)], state.tool[:4], [state.branch]])
        )

    def _value(self, context: Context) -> ToolMotionState:
        return context.get_abstract_state(int(self._state)).get_value()


class DifferentialIkSystem(LeafSystem):
    """Turns desired tool poses into joint set-points within the limits of position, speed and torque.

    .. pydrake_system::

        name: DifferentialIkSystem
        input_ports:
        - X_WT_desired
        - q_last
        output_ports:
        - q_commanded

    - ``X_WT_desired``: the desired pose of the tool, a RigidTransform; it is always valid.
    - ``q_last``: the set-point that the joints really received last, n values [rad]. Unconnected: the last
      ``q_commanded``.
    - ``q_commanded``: joint set-points, n values [rad], for the same instant as the pose: `SPLINE_DELAY` periods after
      the set-point is sampled. It is state, updated every period in the last slot of the servo.

    The set-point integrates from ``q_initial``, through ``q_last``, and never reads the measured joints: the joint
    servo closes that loop.

    Args:
        model: the arm.
        q_initial: joint set-points at the start, shape (n,) [rad].
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(
        self,
        model: ArmModel,
        q_initial: Sequence[float] | np.ndarray,
        time_step: float = TIME_STEP,
        period: float = SERVO_PERIOD,
    ) -> None:
        super().__init__()
        self._model = model
        self._parameters = make_parameters(model, period)
        self._pose = self.DeclareAbstractInputPort("X_WT_desired", AbstractValue.Make(RigidTransform()))
        self._last = self.DeclareVectorInputPort("q_last", len(q_initial))
        set_point = self.DeclareDiscreteState(q_initial)
        self.DeclareDiscreteState(len(q_initial))  # velocity of the last step [rad/s]
        self.DeclareStateOutputPort("q_commanded", set_point)
        offset = servo_slot(IK_SLOT, time_step, period)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, next_state: DiscreteValues) -> None:
        q, v_last = (context.get_discrete_state(group).value() for group in (0, 1))
        if self._last.HasValue(context):
            q_last = self._last.Eval(context)
            v_last = v_last + (q_last - q) / self._parameters.get_time_step()
            q = q_last
        q_next, _ = step_joints(self._model, self._parameters, q, self._pose.Eval(context))
        q_next, v = limit_acceleration(self._model, self._parameters, q, v_last, q_next)
        next_state.set_value(0, q_next)
        next_state.set_value(1, v)


class ToolController(NamedTuple):
    """The Systems that move the tool.

    Attributes:
        transform_equation: from target and command to the desired pose of the tool.
        inverse_kinematics: from there to joint set-points.
        reflex: makes the joints hold still when they meet something; its inputs remain to be connected, without which
            it does nothing.
        limiter: from there to set-points within the limits of the arm.
        spline: from there to the desired joint state.
        inverse_dynamics: feedforward torques; its input port for the estimated state remains to be connected.
    """

    transform_equation: TransformEquationSystem
    inverse_kinematics: DifferentialIkSystem
    reflex: CollisionReflexSystem
    limiter: JointLimiterSystem
    spline: SetPointSplineSystem
    inverse_dynamics: InverseDynamics


def add_tool_controller(
    builder: DiagramBuilder,
    *,
    motion: ToolMotion,
    model: ArmModel,
    q_initial: Sequence[float] | np.ndarray,
    target: OutputPort,
    command: OutputPort,
    time_step: float = TIME_STEP,
    period: float = SERVO_PERIOD,
    clearance: ArmClearance | None = None,
) -> ToolController:
    """Adds transform equation, inverse kinematics, collision reflex, joint limiter, set-point spline and feedforward
    torques, connected to each other.

    Args:
        builder: the diagram's builder.
        motion: arithmetic of the tool's motions.
        model: the arm.
        q_initial: joint positions at the start, shape (n,) [rad].
        target: output port of the object or the goal (`ServoTarget`).
        command: output port of the motion to make (`ArmCommand`).
        time_step: the plant's step [s].
        period: period of the set-points [s].
        clearance: distances that the limiter keeps; None: it keeps none.
    """
    transform = builder.AddNamedSystem(
        "transform_equation", TransformEquationSystem(motion, model, q_initial, time_step, period)
    )
    ik = builder.AddNamedSystem("inverse_kinematics", DifferentialIkSystem(model, q_initial, time_step, period))
    joint_limiter = JointLimiter(model, period, clearance)
    limiter = builder.AddNamedSystem("joint_limiter", JointLimiterSystem(joint_limiter, q_initial, time_step, period))
    q_commanded = limiter.GetOutputPort("q_commanded")
    spline = add_set_point_spline(
        builder, name="joint_spline", set_points=q_commanded, initial=q_initial, period=period
    )
    reflex = builder.AddNamedSystem("collision_reflex", CollisionReflexSystem(model, time_step))
    builder.Connect(reflex.GetOutputPort("hold"), limiter.GetInputPort("hold"))
    builder.Connect(reflex.GetOutputPort("hold"), spline.GetInputPort("hold"))
    dynamics = add_joint_feedforward(
        builder, model=model, desired_acceleration=spline.GetOutputPort("desired_acceleration")
    )
    builder.Connect(target, transform.GetInputPort("target"))
    builder.Connect(command, transform.GetInputPort("command"))
    builder.Connect(transform.GetOutputPort("X_WT_desired"), ik.GetInputPort("X_WT_desired"))
    builder.Connect(ik.GetOutputPort("q_commanded"), limiter.GetInputPort("q_wanted"))
    builder.Connect(q_commanded, ik.GetInputPort("q_last"))
    builder.Connect(q_commanded, transform.GetInputPort("q_commanded"))
    return ToolController(transform, ik, reflex, limiter, spline, dynamics)
