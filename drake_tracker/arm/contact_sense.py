"""What the arm feels of a touch: the share of its drives' torques that its own motion does not explain.

The drives give u, the controller's model says which torques u_m the motion takes in free air (gravity, friction,
inertia). A force F on the tool, p_WT's Jacobian being J, makes up the rest::

    u_m(q, v, a) = u + J^T F

n equations for three unknowns, solved by least squares. The acceleration is the commanded one: encoders give none. The
simulated drives report their torque, and the model its masses, without error; a real arm needs a higher threshold.
"""

import math

import numpy as np


def contact_force(model, q, v, acceleration, effort):
    """Returns the force F on the tool's origin [N], expressed in W, shape (3,).

    Args:
      model: `ArmModel` of the arm with its tool.
      q, v: measured joints [rad], [rad/s]. acceleration: commanded [rad/s^2]. effort: torques of the drives [N m].
    """
    unexplained = model.drive_torques(q, v, acceleration) - np.asarray(effort)
    _, J_WT = model.tool_pose_and_jacobian(q)
    return np.linalg.lstsq(J_WT[3:].T, unexplained, rcond=None)[0]


def low_pass(filtered, value, period, time_constant):
    """Returns ``filtered`` after a period [s] of a first-order low-pass with the time constant [s]."""
    return filtered + (1.0 - math.exp(-period / time_constant)) * (value - filtered)
