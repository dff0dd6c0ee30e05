"""Adds an arm and its hand to a MultibodyPlant, and sets the gains of its joint servos."""

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuator, ModelInstanceIndex, PdControllerGains

from drake_tracker.arm.description import ArmDescription
from drake_tracker.core.models_path import models_path


@dataclass(frozen=True)
class ArmParts:
    """Model instances of an arm that was added to a plant.

    Attributes:
        arm: the arm without its hand.
        gripper: the hand, be it a gripper or a cup.
    """

    arm: ModelInstanceIndex
    gripper: ModelInstanceIndex


def models_parser(plant: MultibodyPlant) -> Parser:
    """Returns a Parser that knows the project's package of models."""
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(models_path() / "package.xml"))
    return parser


def add_arm(plant: MultibodyPlant, *, description: ArmDescription) -> ArmParts:
    """Adds an arm and its hand to a plant, with the arm's base welded to the world at the origin of W.

    Args:
        plant: a plant that is not finalized.
        description: the arm.
    """
    parser = models_parser(plant)
    (arm,) = parser.AddModelsFromUrl(description.arm_url)
    (gripper,) = parser.AddModelsFromUrl(description.gripper_url)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(description.base_link, arm))
    plant.WeldFrames(
        plant.GetFrameByName(description.flange, arm), plant.GetFrameByName(description.hand_link, gripper)
    )
    return ArmParts(arm, gripper)


def couple_fingers(
    plant: MultibodyPlant, gripper: ModelInstanceIndex, description: ArmDescription, grip_force: float = 25.0
) -> None:
    """Couples the second finger to the first, and sets the drive of the first. Call before Finalize().

    The coupling shares the drive's force equally between the pads, so that a force on each pad takes a drive with
    twice that force.

    Args:
        plant: a plant that is not finalized.
        gripper: model instance of the hand.
        description: the arm.
        grip_force: largest force on each pad [N]; the model's effort limit may be lower.
    """
    driven, follower = (plant.GetJointByName(name, gripper) for name in description.fingers)
    plant.AddCouplerConstraint(follower, driven, 1.0)
    (strongest,) = actuators_of(plant, gripper)
    plant.RemoveJointActuator(strongest)
    actuator = plant.AddJointActuator(strongest.name(), driven, min(2.0 * grip_force, strongest.effort_limit()))
    actuator.set_controller_gains(PdControllerGains(p=description.finger_stiffness, d=description.finger_damping))


def actuators_of(plant: MultibodyPlant, instance: ModelInstanceIndex) -> list[JointActuator]:
    """Returns the actuators of a model instance, in order. Unlike the plant's own list, this list is also available
    before Finalize()."""
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return [actuator for actuator in actuators if actuator.model_instance() == instance]


def set_servo_gains(
    plant: MultibodyPlant, instance: ModelInstanceIndex, inertia: Sequence[float], bandwidth: Sequence[float]
) -> None:
    """Sets the PD gains Kp = J w^2, Kd = 2 J w of every actuator of a model instance. Call before Finalize().

    Args:
        plant: a plant that is not finalized.
        instance: the model instance.
        inertia: J, the inertia that each actuator moves [kg m^2 or kg], in the order of the actuators.
        bandwidth: w of each actuator [rad/s], in the same order.
    """
    for actuator, J, w in zip(actuators_of(plant, instance), inertia, bandwidth, strict=True):
        actuator.set_controller_gains(PdControllerGains(p=J * w**2, d=2.0 * J * w))
