"""The part of the arm's computer that every task shares: from a target and a command to the joint servos."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.differential_ik_system import DifferentialIkSystem
from drake_tracker.arm.motion.set_point_spline_system import (
    SetPointSplineSystem,
    add_joint_feedforward,
    add_set_point_spline,
)
from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.arm.motion.transform_equation_system import TransformEquationSystem
from drake_tracker.arm.safety.collision_reflex_system import CollisionReflexSystem
from drake_tracker.arm.safety.joint_limiter import JointLimiter
from drake_tracker.arm.safety.joint_limiter_system import JointLimiterSystem
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP


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
