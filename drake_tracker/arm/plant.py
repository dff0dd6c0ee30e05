"""Adds an arm and its hand to a MultibodyPlant, and sets the gains of its joint servos."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, JointActuator, ModelInstanceIndex, PdControllerGains

from drake_tracker.arm.description import ArmDescription
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.models_path import models_path

_PACKAGE = "package://drake_tracker_models/"
_HINTS = {"unsupported extension": "convert the mesh to .obj", "set_velocity_limits": "a velocity limit is negative"}
"""Advice for parts of Drake's messages."""


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


def is_packaged(description: ArmDescription) -> bool:
    """Returns whether the models of an arm and its hand are the package's own, whose files do not change."""
    return description.arm_url.startswith(_PACKAGE) and description.gripper_url.startswith(_PACKAGE)


def add_arm(plant: MultibodyPlant, *, description: ArmDescription) -> ArmParts:
    """Adds an arm and its hand to a plant, with the arm's base welded to the world on the axis z of W.

    Args:
        plant: a plant that is not finalized.
        description: the arm.

    Raises DrakeTrackerError when a file cannot be read or does not hold one model, or when a frame does not exist.
    """
    parser = models_parser(plant)
    arm = _only_model(parser, description.arm_url, "own_arm")
    gripper = _only_model(parser, description.gripper_url, "own_hand")
    base = named_frame(plant, arm, description, "base_link")
    for index in plant.GetJointIndices(arm):  # many descriptions fix the base to a link that is named world
        joint = plant.get_joint(index)
        if joint.parent_body() == plant.world_body() and joint.child_body() == base.body():
            plant.RemoveJoint(joint)
    plant.WeldFrames(plant.world_frame(), base, RigidTransform([0.0, 0.0, description.base_height]))
    _add_drives(plant, arm, parser.package_map().ResolveUrl(description.arm_url))
    plant.WeldFrames(
        named_frame(plant, arm, description, "flange"), named_frame(plant, gripper, description, "hand_link")
    )
    return ArmParts(arm, gripper)


def named_frame(
    plant: MultibodyPlant, instance: ModelInstanceIndex, description: ArmDescription, field: str, name: str = ""
) -> Frame:
    """Returns the frame of a model that a field of the description names.

    Args:
        plant: the plant.
        instance: the model instance.
        description: the arm.
        field: the field, for messages.
        name: name of the frame; empty: the value of the field.

    Raises DrakeTrackerError when the model has no such frame.
    """
    name = name or getattr(description, field)
    if plant.HasFrameNamed(name, instance):
        return plant.GetFrameByName(name, instance)
    url = description.arm_url if field in ("base_link", "flange") else description.gripper_url
    frames = [plant.get_frame(index).name() for index in plant.GetFrameIndices(instance)]
    known = ", ".join(frame for frame in frames if not frame.startswith("__"))
    raise DrakeTrackerError(f"{field}: {url} has no frame {name}; its frames are {known}")


def _only_model(parser: Parser, url: str, name: str) -> ModelInstanceIndex:
    """Returns the model that a file holds, under a name that no other model of a laboratory has if the file is the
    user's. The packages in ROS_PACKAGE_PATH are known then, and each folder above the file is a package of its name.
    """
    plant, known, own = parser.plant(), parser.package_map(), not url.startswith(_PACKAGE)
    constraints = plant.num_constraints()
    try:
        if own:
            known.PopulateFromRosPackagePath()
            for folder in Path(known.ResolveUrl(url)).parents:
                if folder.name and not known.Contains(folder.name):
                    known.Add(folder.name, str(folder))
        models = parser.AddModelsFromUrl(url)
    except (RuntimeError, ValueError, SystemExit) as error:  # Drake says what is wrong; SystemExit for a bad value
        text = re.sub(r"^Failure at \S+ in ", "", " ".join(str(error).split()))
        hint = next((f"; {hint}" for part, hint in _HINTS.items() if part in text), "")
        raise DrakeTrackerError(f"{url}: {text}{hint}") from None
    if len(models) != 1:
        raise DrakeTrackerError(f"{url} holds {len(models)} models; it must hold one")
    if plant.num_constraints() > constraints:
        raise DrakeTrackerError(f"{url} has constraints such as <mimic>; remove them, since fingers are coupled anyway")
    if own:
        plant.RenameModelInstance(models[0], name)
    return models[0]


def _add_drives(plant: MultibodyPlant, arm: ModelInstanceIndex, path: str) -> None:
    """Adds an actuator with the joint's effort limit to each joint of a URDF that describes no transmission at all.

    Most public descriptions of arms have no transmissions, because other simulators drive every joint.
    """
    if actuators_of(plant, arm) or not path.lower().endswith(".urdf"):
        return
    for joint in ElementTree.parse(path).getroot().findall("joint"):
        limit = joint.find("limit")
        if joint.get("type") == "revolute" and limit is not None:
            name, effort = joint.get("name", ""), float(limit.get("effort", "0"))
            if not effort > 0.0:
                raise DrakeTrackerError(f"{path}: joint {name} has the effort limit {effort:g} N m; it must be above 0")
            plant.AddJointActuator(name, plant.GetJointByName(name, arm), effort)


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
    name, effort_limit = strongest.name(), min(2.0 * grip_force, strongest.effort_limit())
    plant.RemoveJointActuator(strongest)  # frees the actuator: its name and limit were read before
    actuator = plant.AddJointActuator(name, driven, effort_limit)
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
