"""One step of differential inverse kinematics within the arm's joint and speed limits."""

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
)

SPEED_SHARE = 0.95
"""Share of each joint's rated speed that a set-point may use: the rest is the joint servo's, to correct with."""
EFFORT_SHARE = 0.85
"""Share of each drive's torque that a change of speed may use, gravity and friction apart."""
LIMIT_MARGIN = np.deg2rad(2.0)
"""Distance that set-points keep from each joint limit [rad]."""

CENTERING_RATE = 2.0
"""Rate [1/s] at which an arm with more joints than the tool needs returns to its nominal joints."""


def make_parameters(model, time_step, centering_rate=CENTERING_RATE):
    """Returns Drake's parameters of the step for an `ArmModel` and a set-point period [s].

    With more than six joints, ``centering_rate`` [1/s] times the distance to the model's nominal joints is the speed
    that the step seeks in the null space of the Jacobian: the tool does not feel it. With 0 the joints wander.
    """
    n = model.num_joints
    parameters = DifferentialInverseKinematicsParameters(n, n)
    parameters.set_time_step(time_step)
    speed = SPEED_SHARE * model.velocity_limit
    parameters.set_joint_velocity_limits((-speed, speed))
    parameters.set_joint_position_limits((model.position_lower + LIMIT_MARGIN, model.position_upper - LIMIT_MARGIN))
    if n > 6:
        parameters.set_nominal_joint_position(model.q_nominal)
        parameters.set_joint_centering_gain(centering_rate * np.eye(n))
    return parameters


def step_joints(model, parameters, q, X_WT_desired):
    """Moves the set-point q [rad] towards the pose X_WT_desired by one period.

    The motion keeps the direction of the remaining displacement and is slowed where a limit demands it.

    Returns:
      (q_next, ok): the next set-point, and whether it follows without being slowed or stuck.
    """
    time_step = parameters.get_time_step()
    X_WT, J_WT = model.tool_pose_and_jacobian(q)
    R_error = X_WT_desired.rotation() @ X_WT.rotation().inverse()
    displacement = np.concatenate([rotation_vector(R_error), X_WT_desired.translation() - X_WT.translation()])
    V_WT = displacement / time_step
    result = DoDifferentialInverseKinematics(q, np.zeros_like(q), V_WT, J_WT, parameters)
    if result.status == DifferentialInverseKinematicsStatus.kNoSolutionFound or result.joint_velocities is None:
        return np.array(q), False
    v = np.asarray(result.joint_velocities)
    reached = np.linalg.norm(J_WT @ v - V_WT) <= 1e-3 * max(1.0, np.linalg.norm(V_WT))
    return q + time_step * v, bool(reached)


def limit_acceleration(model, parameters, q, v_last, q_next):
    """Returns (q_next, v): the next set-point [rad], held back where the drives cannot change speed so fast.

    ``v_last`` [rad/s] is the speed of the last step. What cannot be slowed at once overshoots by a little, and the next
    steps bring it back.
    """
    time_step = parameters.get_time_step()
    change = EFFORT_SHARE * model.effort_limit / model.inertia(q) * time_step
    v = np.clip((q_next - q) / time_step, v_last - change, v_last + change)
    lower, upper = parameters.get_joint_position_limits()
    q_next = np.clip(q + time_step * v, lower, upper)
    return q_next, (q_next - q) / time_step


def rehearse(model, parameters, q, tool_poses, tolerance):
    """Runs the set-points ahead along ``tool_poses`` and says whether the arm can follow.

    Args:
      q: set-point to start from [rad].
      tool_poses: the X_WT desired at each period to come.
      tolerance: greatest distance [m] from a desired position at which the arm still counts as following.

    Returns:
      bool.
    """
    for X_WT_desired in tool_poses:
        q, _ = step_joints(model, parameters, q, X_WT_desired)
        error = model.tool_pose(q).translation() - X_WT_desired.translation()
        if np.linalg.norm(error) > tolerance:
            return False
    return True


def rotation_vector(R):
    """Returns the rotation vector [rad] (axis times angle) of a RotationMatrix."""
    angle_axis = RotationMatrix(R).ToAngleAxis()
    return angle_axis.angle() * angle_axis.axis()
