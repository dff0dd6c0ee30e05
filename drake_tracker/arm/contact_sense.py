"""Contact force from the joint torques that the arm's own motion does not explain.

The joint servos apply torques u; the controller's model gives the torques u_m that the motion takes in free air
(gravity, friction, inertia). A force F on the tool, with J the Jacobian of p_WT, explains the difference::

    u_m(q, v, a) = u + J^T F

These are n equations for three unknowns, solved by least squares. The acceleration is the commanded one, since encoders
do not measure it. The simulated drives report their torques, and the model its masses, without error; a real arm needs
a higher threshold.
"""

import math

import numpy as np

from drake_tracker.arm.arm_model import ArmModel


def contact_force(
    model: ArmModel, q: np.ndarray, v: np.ndarray, acceleration: np.ndarray, effort: np.ndarray
) -> np.ndarray:
    """Returns the force F on the tool's origin, expressed in W, shape (3,) [N].

    Args:
        model: the arm with its tool.
        q: measured joint positions, shape (n,) [rad].
        v: measured joint velocities, shape (n,) [rad/s].
        acceleration: commanded joint accelerations, shape (n,) [rad/s^2].
        effort: torques that the joint servos apply, shape (n,) [N m].
    """
    unexplained = model.drive_torques(q, v, acceleration) - np.asarray(effort)
    _, J_WT = model.tool_pose_and_jacobian(q)
    return np.linalg.lstsq(J_WT[3:].T, unexplained, rcond=None)[0]


def low_pass(filtered: float, value: float, period: float, time_constant: float) -> float:
    """Returns the output of a first-order low-pass filter after one more period.

    Args:
        filtered: the output before.
        value: the input.
        period: time since the last input [s].
        time_constant: time constant of the filter [s].
    """
    return filtered + (1.0 - math.exp(-period / time_constant)) * (value - filtered)
