"""Feedforward torques and smooth set-points for the joint servos, which are the plant's own PD control."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.set_point_spline_system import SetPointSplineSystem
from drake_tracker.core.timing import SERVO_PERIOD


def add_joint_feedforward(
    builder: DiagramBuilder, *, model: ArmModel, desired_acceleration: OutputPort, name: str = "inverse_dynamics"
) -> InverseDynamics:
    """Adds Drake's `InverseDynamics` on the controller's own model of the arm, and returns it.

    It computes the torques for gravity, friction and the desired acceleration, so that the actuators' PD control only
    has to correct the errors. Its input port for the estimated state remains to be connected.

    Args:
        builder: the diagram's builder.
        model: the arm.
        desired_acceleration: output port of the desired joint accelerations, n values [rad/s^2].
        name: name of the System.
    """
    dynamics = builder.AddNamedSystem(
        name, InverseDynamics(model.plant, InverseDynamics.InverseDynamicsMode.kInverseDynamics)
    )
    builder.Connect(desired_acceleration, dynamics.get_input_port_desired_acceleration())
    return dynamics


def add_set_point_spline(
    builder: DiagramBuilder,
    *,
    name: str,
    set_points: OutputPort,
    initial: Sequence[float] | np.ndarray,
    period: float = SERVO_PERIOD,
) -> SetPointSplineSystem:
    """Adds a `SetPointSplineSystem` behind an output port of set-points, and returns it.

    Args:
        builder: the diagram's builder.
        name: name of the System.
        set_points: output port of the set-points, n values.
        initial: the set-point held before the first sample, shape (n,).
        period: period of the set-points [s].
    """
    spline = builder.AddNamedSystem(name, SetPointSplineSystem(initial, period))
    builder.Connect(set_points, spline.GetInputPort("set_point"))
    return spline
