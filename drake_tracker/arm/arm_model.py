"""The controller's own model of the arm: kinematics and limits, nothing of the scene."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

from drake_tracker.arm.transform_equation import tool_down_rotation


class ArmModel:
    """Kinematics of an arm with a tool, computed on a plant that holds the arm and its hand alone.

    Every method sets all that it reads in one scratch Context, which keeps nothing from call to call (to make a new one
    each time takes longer than what it is made for): an ArmModel can be shared by Systems without being their state.

    Args:
      plant: a finalized MultibodyPlant whose only positions, after ``arm_joints``, may be the hand's fingers.
      arm_instance: the model instance of the arm.
      tool_frame: the frame T, z_T along the approach, y_T along the jaws' opening.
      q_nominal: joints [rad] about which a redundant arm stays.
      symmetric_hand: whether half a turn about z_T leaves the hand as it is.
    """

    def __init__(self, plant, arm_instance, tool_frame, q_nominal, symmetric_hand=True):
        self.plant = plant
        self.arm_instance = arm_instance
        self.tool_frame = tool_frame
        self.q_nominal = np.array(q_nominal, dtype=float)
        self.symmetric_hand = symmetric_hand
        joints = [plant.get_joint(index) for index in plant.GetJointIndices(arm_instance)]
        joints = [joint for joint in joints if joint.num_velocities() == 1]
        self._columns = [joint.velocity_start() for joint in joints]
        self.position_lower = np.array([joint.position_lower_limits()[0] for joint in joints])
        self.position_upper = np.array([joint.position_upper_limits()[0] for joint in joints])
        self.velocity_limit = np.array([joint.velocity_upper_limits()[0] for joint in joints])
        self.num_joints = len(joints)
        self._scratch = plant.CreateDefaultContext()
        self.effort_limit = np.array([plant.GetJointActuatorByName(joint.name()).effort_limit() for joint in joints])

    def tool_pose(self, q):
        """Returns X_WT (RigidTransform) at arm positions q [rad]."""
        context = self._context_at(q)
        return self.plant.CalcRelativeTransform(context, self.plant.world_frame(), self.tool_frame)

    def tool_pose_and_jacobian(self, q):
        """Returns X_WT and the (6, n) Jacobian of V_WT (angular velocity first), expressed in W."""
        context = self._context_at(q)
        world = self.plant.world_frame()
        X_WT = self.plant.CalcRelativeTransform(context, world, self.tool_frame)
        J_WT = self.plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, self.tool_frame, np.zeros(3), world, world
        )
        return X_WT, J_WT[:, self._columns]

    def inertia(self, q):
        """Returns what each joint feels of the arm's inertia at q, its rotor's included, shape (n,) [kg m^2]."""
        M = self.plant.CalcMassMatrix(self._context_at(q))
        return np.diag(M)[self._columns]

    def drive_torques(self, q, v, acceleration):
        """Returns the torques [N m], shape (n,), that this motion takes when nothing touches the arm: gravity, friction
        and inertia."""
        context = self._context_at(q)
        self.plant.SetVelocities(context, self.arm_instance, v)
        vdot = np.zeros(self.plant.num_velocities())
        vdot[self._columns] = acceleration
        forces = MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(context, forces)
        return self.plant.CalcInverseDynamics(context, vdot, forces)[self._columns]

    def _context_at(self, q):
        self.plant.SetPositions(self._scratch, self.arm_instance, q)
        return self._scratch


def tool_down(p_WT, yaw):
    """Returns X_WT with the tool pointing down and x_T turned by ``yaw`` [rad] from x_W about z_W."""
    return RigidTransform(RotationMatrix(tool_down_rotation(yaw)), p_WT)


def tool_yaw(X_WT):
    """Returns the angle [rad] of x_T about z_W, in (-pi, pi]: the inverse of `tool_down`."""
    R = X_WT.rotation().matrix()
    return float(np.arctan2(R[1, 0], R[0, 0]))
