"""Differential inverse kinematics within the arm's joint and speed limits."""

from collections.abc import Iterable, Sequence

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
)

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.core.errors import DrakeTrackerError

SPEED_SHARE = 0.95
"""Fraction of each joint's rated speed that set-points may use; the joint servo needs the rest for corrections."""
EFFORT_SHARE = 0.85
"""Fraction of each joint's torque limit that changes of speed may use, besides gravity and friction."""
LIMIT_MARGIN = np.deg2rad(2.0)
"""Distance that set-points keep from each joint limit [rad]."""

OTHER_STARTS = 20
"""Number of further joint positions from which a pose is searched, drawn from the range of the joints."""
_REACHED, _STUCK = 1e-6, 1e-9
"""Largest difference from a pose that is reached, and step of the joints [rad] below which a search has ended."""
_AT_LIMIT = 1e-3
"""Distance from the end of its range below which a joint limits the search [rad]."""
CENTERING_RATE = 2.0
"""Rate [1/s] at which an arm with more joints than the tool needs returns to its nominal joint positions."""


def make_parameters(
    model: ArmModel, time_step: float, centering_rate: float = CENTERING_RATE
) -> DifferentialInverseKinematicsParameters:
    """Returns Drake's parameters of one step.

    Args:
        model: the arm.
        time_step: period of the set-points [s].
        centering_rate: for more than six joints, the null-space velocity that the step seeks is this rate [1/s] times
            the distance to the model's nominal joint positions; it does not move the tool. With 0 the joints drift.
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


def step_joints(
    model: ArmModel, parameters: DifferentialInverseKinematicsParameters, q: np.ndarray, X_WT_desired: RigidTransform
) -> tuple[np.ndarray, bool]:
    """Moves a set-point towards a pose of the tool by one period.

    The motion keeps the direction of the remaining displacement, and is slowed down where a limit requires it.

    Args:
        model: the arm.
        parameters: of `make_parameters`.
        q: the set-point, shape (n,) [rad].
        X_WT_desired: the desired pose of the tool.

    Returns:
        The next set-point, shape (n,) [rad], and whether it reaches the pose without being slowed down or stuck.
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
    reached = np.linalg.norm(J_WT @ v - V_WT) <= 1e-3 * max(1.0, float(np.linalg.norm(V_WT)))
    return q + time_step * v, bool(reached)


def limit_acceleration(
    model: ArmModel,
    parameters: DifferentialInverseKinematicsParameters,
    q: np.ndarray,
    v_last: np.ndarray,
    q_next: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Limits a step to the change of speed that the joint torques allow.

    A joint that cannot slow down in time overshoots slightly, and the following steps correct it.

    Args:
        model: the arm.
        parameters: of `make_parameters`.
        q: the set-point, shape (n,) [rad].
        v_last: velocity of the last step, shape (n,) [rad/s].
        q_next: the next set-point that is wanted, shape (n,) [rad].

    Returns:
        The next set-point [rad] and the velocity [rad/s] of the step, each of shape (n,).
    """
    time_step = parameters.get_time_step()
    change = EFFORT_SHARE * model.effort_limit / model.inertia(q) * time_step
    v = np.clip((q_next - q) / time_step, v_last - change, v_last + change)
    lower, upper = parameters.get_joint_position_limits()
    q_next = np.clip(q + time_step * v, lower, upper)
    return q_next, (q_next - q) / time_step


def rehearse(
    model: ArmModel,
    parameters: DifferentialInverseKinematicsParameters,
    q: np.ndarray,
    tool_poses: Iterable[RigidTransform],
    tolerance: float,
) -> bool:
    """Computes the set-points along a path of the tool in advance. Returns whether the arm can follow it.

    Args:
        model: the arm.
        parameters: of `make_parameters`.
        q: set-point from which the path starts, shape (n,) [rad].
        tool_poses: the desired X_WT of each period to come.
        tolerance: largest distance [m] from a desired position at which the arm still counts as following.
    """
    for X_WT_desired in tool_poses:
        q, _ = step_joints(model, parameters, q, X_WT_desired)
        error = model.tool_pose(q).translation() - X_WT_desired.translation()
        if np.linalg.norm(error) > tolerance:
            return False
    return True


def joints_for(model: ArmModel, q_start: Sequence[float] | np.ndarray, X_WT: RigidTransform) -> np.ndarray:
    """Returns joint positions, shape (n,) [rad], that bring the tool to a pose, found by differential steps.

    The search is repeated from other starts if the first start does not lead to the pose, because each search is local.
    The nearest start is next, so that the arm stays in the posture of the first start if possible.
    A symmetric hand may also be turned by half a turn.

    Args:
        model: the arm.
        q_start: joint positions from which the first search starts, shape (n,) [rad].
        X_WT: the pose of the tool.

    Raises DrakeTrackerError when no search reaches the pose; the message names the joints that are at their limits.
    """
    turned = X_WT @ RigidTransform(RotationMatrix.MakeZRotation(np.pi), np.zeros(3))
    goals = (X_WT, turned) if model.symmetric_hand else (X_WT,)
    lower, upper = model.position_lower + LIMIT_MARGIN, model.position_upper - LIMIT_MARGIN
    first = np.array(q_start, dtype=float)
    others = np.random.default_rng(0).uniform(lower, upper, (OTHER_STARTS, len(lower)))
    starts = [first, *sorted(others, key=lambda start: float(np.abs(start - first).max()))]
    parameters = make_parameters(model, 0.05)
    least, best = np.inf, starts[0]
    for start in starts:
        for goal in goals:
            q = _descend(model, parameters, start, goal)
            reached = model.tool_pose(q)
            if reached.IsNearlyEqualTo(goal, _REACHED):
                return q
            error = float(np.linalg.norm(reached.translation() - goal.translation()))
            if error < least:
                least, best = error, q
    at_limit = np.minimum(best - lower, upper - best) < _AT_LIMIT
    names = ", ".join(name for name, is_limit in zip(model.joint_names, at_limit) if is_limit)
    raise DrakeTrackerError(
        f"the arm cannot bring its tool to {np.round(X_WT.translation(), 3).tolist()} m: {least:.3f} m short"
        + (f", with {names} at the limit" if names else "")
    )


def _descend(
    model: ArmModel, parameters: DifferentialInverseKinematicsParameters, q: np.ndarray, X_WT: RigidTransform
) -> np.ndarray:
    """Returns the joint positions, shape (n,) [rad], at which differential steps towards a pose end."""
    for _ in range(400):
        q_last = q
        q, _ = step_joints(model, parameters, q, X_WT)
        if model.tool_pose(q).IsNearlyEqualTo(X_WT, _REACHED) or np.abs(q - q_last).max() < _STUCK:
            break
    return q


def rotation_vector(R: RotationMatrix) -> np.ndarray:
    """Returns the rotation vector (axis times angle), shape (3,) [rad], of a rotation."""
    angle_axis = RotationMatrix(R).ToAngleAxis()
    return angle_axis.angle() * angle_axis.axis()
