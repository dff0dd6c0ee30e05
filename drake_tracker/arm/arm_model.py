"""The controller's own model of the arm: kinematics, dynamics and limits, without the scene."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, JacobianWrtVariable, ModelInstanceIndex, MultibodyForces, WeldJoint

from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.motion.transform_equation import LEVEL, Slope, tool_down_rotation
from drake_tracker.arm.plant import ArmParts, actuators_of, add_arm, is_packaged


class ArmModel:
    """Kinematics and dynamics of an arm with a tool, on a plant that holds only the arm and its hand.

    One scratch Context serves all methods, since creating a Context takes longer than computing with it. Each method
    first sets everything that it reads, so that nothing is kept from call to call: Systems can share an ArmModel
    without its being part of their state.

    Args:
        plant: a finalized plant whose only positions, besides the arm's joints, may be those of the hand's fingers.
        arm_instance: model instance of the arm.
        tool_frame: the frame T, z_T along the approach, y_T along the jaws' opening.
        q_nominal: joint positions [rad] near which a redundant arm stays.
        symmetric_hand: whether half a turn about z_T leaves the hand as it is.

    Attributes:
        plant: as given.
        arm_instance: as given.
        tool_frame: as given.
        q_nominal: as given, shape (n,) [rad].
        symmetric_hand: as given.
        num_joints: number n of the arm's joints.
        joint_names: their names, in the order of q.
        position_lower: lower joint limits, shape (n,) [rad].
        position_upper: upper joint limits, shape (n,) [rad].
        velocity_limit: rated joint speeds, shape (n,) [rad/s].
        effort_limit: largest joint torques, shape (n,) [N m].
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        arm_instance: ModelInstanceIndex,
        tool_frame: Frame,
        q_nominal: Sequence[float],
        symmetric_hand: bool = True,
    ) -> None:
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
        self.joint_names = tuple(joint.name() for joint in joints)
        self._scratch = plant.CreateDefaultContext()
        drives = {drive.joint().index(): drive for drive in actuators_of(plant, arm_instance)}
        self.effort_limit = np.array([drives[joint.index()].effort_limit() for joint in joints])

    def tool_pose(self, q: Sequence[float] | np.ndarray) -> RigidTransform:
        """Returns X_WT at joint positions q, shape (n,) [rad]."""
        context = self._context_at(q)
        return self.plant.CalcRelativeTransform(context, self.plant.world_frame(), self.tool_frame)

    def body_poses(self, q: Sequence[float] | np.ndarray) -> dict[str, np.ndarray]:
        """Returns {name of a body B of arm or hand: X_WB, shape (4, 4) [m]} at joint positions q, shape (n,) [rad]."""
        plant, context = self.plant, self._context_at(q)
        bodies = [plant.get_body(index) for index in plant.GetBodyIndices(self.arm_instance)]
        bodies += [plant.get_body(i) for i in plant.GetBodyIndices(self.tool_frame.model_instance())]
        return {body.name(): plant.EvalBodyPoseInWorld(context, body).GetAsMatrix4() for body in bodies}

    def tool_pose_and_jacobian(self, q: np.ndarray) -> tuple[RigidTransform, np.ndarray]:
        """Returns X_WT and the (6, n) Jacobian of V_WT (angular velocity first) expressed in W, at q [rad]."""
        context = self._context_at(q)
        world = self.plant.world_frame()
        X_WT = self.plant.CalcRelativeTransform(context, world, self.tool_frame)
        J_WT = self.plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, self.tool_frame, np.zeros(3), world, world
        )
        return X_WT, J_WT[:, self._columns]

    def inertia(self, q: np.ndarray) -> np.ndarray:
        """Returns the diagonal of the arm's mass matrix at q [rad], rotors included, shape (n,) [kg m^2]."""
        M = self.plant.CalcMassMatrix(self._context_at(q))
        return np.diag(M)[self._columns]

    def drive_torques(self, q: np.ndarray, v: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Returns the joint torques of a motion while nothing touches the arm: gravity, friction and inertia.

        Args:
            q: joint positions, shape (n,) [rad].
            v: joint velocities, shape (n,) [rad/s].
            acceleration: joint accelerations, shape (n,) [rad/s^2].

        Returns:
            Torques, shape (n,) [N m].
        """
        context = self._context_at(q)
        self.plant.SetVelocities(context, self.arm_instance, v)
        vdot = np.zeros(self.plant.num_velocities())
        vdot[self._columns] = acceleration
        forces = MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(context, forces)
        return self.plant.CalcInverseDynamics(context, vdot, forces)[self._columns]

    def _context_at(self, q: Sequence[float] | np.ndarray) -> Any:
        self.plant.SetPositions(self._scratch, self.arm_instance, q)
        return self._scratch


def add_held_arm(plant: MultibodyPlant, description: ArmDescription) -> ArmParts:
    """Adds an arm and its hand to a plant, with the fingers of the hand welded in the middle of their travel.

    Args:
        plant: a plant that is not finalized.
        description: the arm.
    """
    parts = add_arm(plant, description=description)
    for actuator in actuators_of(plant, parts.gripper):
        plant.RemoveJointActuator(actuator)
    for name in description.fingers:
        joint = plant.GetJointByName(name, parts.gripper)
        middle = 0.5 * (joint.position_lower_limits()[0] + joint.position_upper_limits()[0])
        X_FM = RigidTransform(joint.translation_axis() * middle)
        parent, child = joint.frame_on_parent(), joint.frame_on_child()
        plant.RemoveJoint(joint)
        plant.AddJoint(WeldJoint(f"{name}_held", parent, child, X_FM))
    return parts


def make_arm_model(description: ArmDescription) -> ArmModel:
    """Returns the controller's model of an arm, with the fingers of its hand welded in the middle of their travel."""
    plant, parts = _held_plant(description) if is_packaged(description) else _held_plant.__wrapped__(description)
    tool_frame = plant.GetFrameByName(description.tool_frame, parts.gripper)
    return ArmModel(plant, parts.arm, tool_frame, description.q_start, symmetric_hand=bool(description.fingers))


@lru_cache(maxsize=8)
def _held_plant(description: ArmDescription) -> tuple[MultibodyPlant, ArmParts]:
    """Returns a finalized plant with an arm and its held hand. All models of an arm share it, each with a Context of
    its own."""
    plant = MultibodyPlant(0.0)
    parts = add_held_arm(plant, description)
    plant.Finalize()
    return plant, parts


def tool_down(p_WT: Sequence[float] | np.ndarray, yaw: float, slope: Slope = LEVEL) -> RigidTransform:
    """Returns X_WT of a tool at p_WT [m] that points down onto a surface; yaw and slope as in `tool_down_rotation`."""
    return RigidTransform(RotationMatrix(tool_down_rotation(yaw, slope)), p_WT)


def tool_yaw(X_WT: RigidTransform) -> float:
    """Returns the angle [rad] of x_T about z_W, in (-pi, pi]: the inverse of `tool_down`."""
    R = X_WT.rotation().matrix()
    return float(np.arctan2(R[1, 0], R[0, 0]))
