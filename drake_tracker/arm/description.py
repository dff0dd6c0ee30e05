"""An arm with its hand, described once for the simulated world and once for the controller's own model of it."""

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PdControllerGains, WeldJoint

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.differential_ik import make_parameters, step_joints
from drake_tracker.arm.joint_servo import actuators_of
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.models_path import models_path

FINGERS = ("finger_left", "finger_right")
"""The gripper's prismatic joints; each travels half the opening, the first is driven and the second coupled to it."""
PROBE_FRAME = "probe"
"""Of the cup: the centre of the spherical tip with which it touches the board's marks."""


@dataclass(frozen=True)
class ArmDescription:
    """What distinguishes one arm from another.

    arm_url, gripper_url: models. base_link: the link welded to the world. flange: the frame that carries the gripper,
    hand_link: the gripper's link that sits on it. servo_inertia: the inertia each joint's servo is tuned for [kg m^2].
    servo_bandwidth: of each joint [rad/s]. q_start: joints [rad] from which the home pose is sought, and about which a
    redundant arm stays. fingers: the hand's joints as `FINGERS`, none for a hand that cannot move, such as a cup.
    """

    arm_url: str
    gripper_url: str
    base_link: str
    flange: str
    hand_link: str
    tool_frame: str
    servo_inertia: tuple
    servo_bandwidth: tuple
    finger_stiffness: float
    finger_damping: float
    q_start: tuple
    fingers: tuple = FINGERS

    @property
    def has_fingers(self):
        return bool(self.fingers)


PUMA560 = ArmDescription(
    arm_url="package://drake_tracker_models/puma560/puma560.sdf",
    gripper_url="package://drake_tracker_models/gripper/gripper.sdf",
    base_link="base",
    flange="flange",
    hand_link="hand",
    tool_frame="tool",
    servo_inertia=(3.7, 4.2, 1.1, 0.25, 0.2, 0.2),
    servo_bandwidth=(60.0, 60.0, 60.0, 40.0, 40.0, 40.0),
    finger_stiffness=5000.0,
    finger_damping=60.0,
    q_start=(0.0, 0.8, -2.6, 0.0, -1.3, 0.0),
)

CUP = {
    "gripper_url": "package://drake_tracker_models/cup/cup.sdf",
    "finger_stiffness": 0.0,
    "finger_damping": 0.0,
    "fingers": (),
}
"""What an `ArmDescription` says of the cup, a hand without fingers."""

PUMA560_CUP = replace(PUMA560, **CUP)

SEVEN_JOINT = ArmDescription(
    arm_url="package://drake_tracker_models/seven_joint/seven_joint.sdf",
    base_link="base",
    flange="flange",
    hand_link="hand",
    tool_frame="tool",
    servo_inertia=(12.0, 20.0, 6.0, 6.0, 0.5, 0.5, 0.4),
    servo_bandwidth=(50.0, 50.0, 50.0, 50.0, 40.0, 40.0, 40.0),
    q_start=(0.0, 0.05, 0.0, 2.15, 0.0, 0.95, 0.0),
    **CUP,
)


@dataclass(frozen=True)
class ArmParts:
    """Model instances of an arm that was added to a plant."""

    arm: object
    gripper: object


def models_parser(plant):
    """Returns a Parser that knows the project's model package."""
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(models_path() / "package.xml"))
    return parser


def add_arm(plant, description):
    """Adds an arm and its gripper to a plant that is not finalized, the base at the origin of W.

    Returns ArmParts.
    """
    parser = models_parser(plant)
    (arm,) = parser.AddModelsFromUrl(description.arm_url)
    (gripper,) = parser.AddModelsFromUrl(description.gripper_url)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(description.base_link, arm))
    plant.WeldFrames(
        plant.GetFrameByName(description.flange, arm), plant.GetFrameByName(description.hand_link, gripper)
    )
    return ArmParts(arm, gripper)


def couple_fingers(plant, gripper, description, grip_force=25.0):
    """Makes the second finger follow the first, and gives the driven finger its drive. Call before Finalize().

    The coupling shares the drive's force equally between the pads, so that a ``grip_force`` [N] on each takes a drive
    of twice that.
    """
    driven, follower = (plant.GetJointByName(name, gripper) for name in description.fingers)
    plant.AddCouplerConstraint(follower, driven, 1.0)
    (strongest,) = actuators_of(plant, gripper)
    plant.RemoveJointActuator(strongest)
    actuator = plant.AddJointActuator(strongest.name(), driven, min(2.0 * grip_force, strongest.effort_limit()))
    actuator.set_controller_gains(PdControllerGains(p=description.finger_stiffness, d=description.finger_damping))


def make_arm_model(description):
    """Returns the controller's `ArmModel`: the arm with its gripper's fingers, if any, held in the middle of their
    travel."""
    plant = MultibodyPlant(0.0)
    parts = add_arm(plant, description)
    for actuator in actuators_of(plant, parts.gripper):
        plant.RemoveJointActuator(actuator)
    for name in description.fingers:
        joint = plant.GetJointByName(name, parts.gripper)
        middle = 0.5 * (joint.position_lower_limits()[0] + joint.position_upper_limits()[0])
        X_FM = RigidTransform(joint.translation_axis() * middle)
        parent, child = joint.frame_on_parent(), joint.frame_on_child()
        plant.RemoveJoint(joint)
        plant.AddJoint(WeldJoint(f"{name}_held", parent, child, X_FM))
    plant.Finalize()
    tool_frame = plant.GetFrameByName(description.tool_frame, parts.gripper)
    return ArmModel(plant, parts.arm, tool_frame, description.q_start, symmetric_hand=description.has_fingers)


def joints_for(model, q_start, X_WT):
    """Returns joint positions [rad] that bring the tool to X_WT, sought from q_start by differential steps.

    Raises DrakeTrackerError when the pose is out of reach.
    """
    parameters = make_parameters(model, 0.05)
    q = np.array(q_start, dtype=float)
    for _ in range(400):
        q, _ = step_joints(model, parameters, q, X_WT)
        reached = model.tool_pose(q)
        if reached.IsNearlyEqualTo(X_WT, 1e-6):
            return q
    error = np.linalg.norm(reached.translation() - X_WT.translation())
    raise DrakeTrackerError(
        f"the arm cannot bring its tool to {np.round(X_WT.translation(), 3).tolist()} m: {error:.3f} m short"
    )
