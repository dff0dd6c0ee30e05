"""Checks that the models of an arm meet the requirements of docs/how_to/arm.md, before anything runs."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, get_args
from xml.etree import ElementTree

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex
from pydrake.planning import RobotDiagramBuilder

from drake_tracker.arm.description import MARKERS, PROBE_FRAME, ArmDescription
from drake_tracker.arm.plant import ArmParts, actuators_of, add_arm, named_frame
from drake_tracker.core.errors import DrakeTrackerError

_LEAST_JOINTS = 6
"""Number of joints that a pose of the tool needs."""
_ALONG = 0.999
"""Least cosine between two axes that must be parallel."""
_TYPES: dict[Any, Any] = {float: (int, float, np.integer, np.floating), str: str, bool: bool}
_RULES: dict[Any, str] = {
    str: "text",
    bool: "True or False",
    float: "a finite number, at least 0",
    tuple[str, ...]: "a tuple of names",
    tuple[float, ...]: "a tuple of numbers",
}
_DRIVES = {True: "one must drive the fingers", False: "a hand without fingers has none"}


def check_arm(arm: ArmDescription) -> None:
    """Checks that the models of an arm meet the requirements of the package, and agree with its description.

    Raises DrakeTrackerError, one line that names the file, the frame or the joint, and the value.
    """
    _check_types(arm)
    builder = RobotDiagramBuilder(time_step=0.0)
    plant = builder.plant()
    try:
        parts = add_arm(plant, description=arm)
        tool = named_frame(plant, parts.gripper, arm, "tool_frame")
        if not arm.has_fingers:
            named_frame(plant, parts.gripper, arm, "a hand without fingers", PROBE_FRAME)
        for marker in MARKERS if arm.markers else ():
            named_frame(plant, parts.gripper, arm, "markers", marker)
        fingers = [plant.GetJointByName(finger, parts.gripper) for finger in arm.fingers]
    except (RuntimeError, ValueError, TypeError, OSError, ElementTree.ParseError) as error:  # it says what is missing
        raise DrakeTrackerError(" ".join(str(error).split())) from None
    _check_links(plant, parts.arm, arm.arm_url, f"base_link, {arm.base_link}")
    _check_links(plant, parts.gripper, arm.gripper_url, f"hand_link, {arm.hand_link}")
    _check_hand(plant, arm, parts, fingers)
    joints = _check_joints(plant, arm, parts)
    _check_values(arm, joints)
    try:
        plant.Finalize()
        builder.Build().CreateDefaultContext()  # reads the meshes
    except (RuntimeError, SystemExit) as error:
        raise DrakeTrackerError(f"{arm.arm_url}: {' '.join(str(error).split())}") from None
    if [joint.name() for joint in sorted(joints, key=lambda joint: joint.velocity_start())] != [
        joint.name() for joint in joints
    ]:
        raise DrakeTrackerError(f"{arm.arm_url}: the joints must be written in the order from base to hand")
    if arm.has_fingers:
        _check_axes(plant, arm, tool, joints[-1], fingers)


def _check_types(arm: ArmDescription) -> None:
    """Checks the type of each value of a description, and the range of the values that do not belong to a joint."""
    for field in fields(arm):
        value, several = getattr(arm, field.name), get_args(field.type)
        kind = several[0] if several else field.type
        values = value if isinstance(value, tuple | list | np.ndarray) else (value,)
        good = all(isinstance(each, _TYPES[kind]) for each in values) and bool(several) is (values is value)
        if not good or (field.type is float and not 0.0 <= value < np.inf):
            raise DrakeTrackerError(f"{field.name} is {' '.join(repr(value).split())}; it must be {_RULES[field.type]}")
    for name in ("arm_url", "gripper_url"):
        if "://" not in getattr(arm, name):
            raise DrakeTrackerError(
                f"{name} is {getattr(arm, name)!r}; it must be a URL, file:// with an absolute path or package://"
            )
    if len(set(arm.fingers)) != len(arm.fingers) or len(arm.fingers) not in (0, 2):
        raise DrakeTrackerError(f"fingers is {arm.fingers!r}; a gripper has two joints, a cup none")


def _check_links(plant: MultibodyPlant, instance: ModelInstanceIndex, url: str, root: str) -> None:
    """Checks that a joint or weld carries each link of a model. A link that nothing carries would fall."""
    carried = {plant.get_joint(index).child_body().index() for index in plant.GetJointIndices()}
    for index in plant.GetBodyIndices(instance):
        if index not in carried:
            raise DrakeTrackerError(f"{url}: link {plant.get_body(index).name()} is not carried by {root}")


def _check_axes(plant: MultibodyPlant, arm: ArmDescription, tool: Frame, last: Any, fingers: Sequence[Any]) -> None:
    """Checks that the last joint turns a gripper about its approach axis, and that its fingers open along y_T."""
    context = plant.CreateDefaultContext()

    def in_tool(joint: Any, axis: np.ndarray) -> np.ndarray:
        return joint.frame_on_parent().CalcPose(context, tool).rotation() @ axis

    along = abs(in_tool(last, last.revolute_axis())[2])
    if along < _ALONG:
        raise DrakeTrackerError(
            f"the axis of the last joint, {last.name()}, is {np.rad2deg(np.arccos(along)):.0f} "
            f"degrees from z of {arm.tool_frame}; it must turn the hand about its approach axis"
        )
    first, second = (in_tool(finger, finger.translation_axis()) for finger in fingers)
    if abs(first[1]) < _ALONG or first @ second > -_ALONG:
        raise DrakeTrackerError(
            f"{arm.gripper_url}: {fingers[0].name()} moves along {np.round(first, 2).tolist()} of {arm.tool_frame}, "
            f"{fingers[1].name()} along {np.round(second, 2).tolist()}; fingers must move along y, away from each other"
        )


def _check_hand(plant: MultibodyPlant, arm: ArmDescription, parts: ArmParts, fingers: Sequence[Joint]) -> None:
    drives = actuators_of(plant, parts.gripper)
    if len(drives) != arm.has_fingers:
        raise DrakeTrackerError(f"{arm.gripper_url} has {len(drives)} actuators; {_DRIVES[arm.has_fingers]}")
    for index in plant.GetJointIndices(parts.gripper):
        joint = plant.get_joint(index)
        if joint.num_velocities() > 0 and joint.name() not in arm.fingers:
            raise DrakeTrackerError(f"{arm.gripper_url}: joint {joint.name()} is not in fingers; fix it in the model")
    for finger in fingers:
        if finger.type_name() != "prismatic":
            raise DrakeTrackerError(
                f"{arm.gripper_url}: {finger.name()} is {finger.type_name()}; fingers are prismatic"
            )
        _check_limits(arm.gripper_url, finger, "position")
        lower, upper = finger.position_lower_limits()[0], finger.position_upper_limits()[0]
        if not lower <= 0.0 < upper:
            raise DrakeTrackerError(
                f"{arm.gripper_url}: {finger.name()} travels from {lower:g} to {upper:g} m; it must be able to travel "
                "from 0, where the pads meet"
            )
    for drive in drives:
        if drive.joint().name() != arm.fingers[0]:
            raise DrakeTrackerError(
                f"{arm.gripper_url}: the actuator drives {drive.joint().name()}; it must drive {arm.fingers[0]}, the "
                "first of fingers"
            )


def _check_joints(plant: MultibodyPlant, arm: ArmDescription, parts: ArmParts) -> list[Any]:
    """Returns the moving joints of the arm, which form a chain of driven revolute joints from the base to the hand."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(parts.arm)]
    moving = [joint for joint in joints if joint.num_velocities() > 0]
    actuators = actuators_of(plant, parts.arm)
    drives = {drive.joint().name(): drive for drive in actuators}
    above = {joint.child_body().index(): joint for joint in joints}
    body, chain = plant.GetFrameByName(arm.flange, parts.arm).body(), []
    while body.index() in above:
        joint = above.pop(body.index())
        chain.append(joint)
        body = joint.parent_body()
    on_chain = {joint.index() for joint in chain}
    for joint in moving:
        where = f"{arm.arm_url}: joint {joint.name()}"
        if joint.index() not in on_chain:
            raise DrakeTrackerError(f"{where} is not between {arm.base_link} and {arm.flange}; fix it in the model")
        if joint.type_name() != "revolute":
            raise DrakeTrackerError(f"{where} is {joint.type_name()}; every joint of an arm must be revolute")
        _check_limits(arm.arm_url, joint, "position")
        _check_limits(arm.arm_url, joint, "velocity")
        drive = drives.get(joint.name())
        if drive is None:
            raise DrakeTrackerError(
                f"{where} has no actuator; it needs an effort limit above 0 and, in a URDF, a transmission"
            )
        if not np.isfinite(drive.effort_limit()):
            raise DrakeTrackerError(f"{where} has no effort limit")
    if len(moving) < _LEAST_JOINTS:
        raise DrakeTrackerError(f"{arm.arm_url} has {len(moving)} joints; a pose of the hand needs {_LEAST_JOINTS}")
    names = [joint.name() for joint in moving]
    driven = [drive.joint().name() for drive in actuators]
    if driven != names:
        raise DrakeTrackerError(
            f"{arm.arm_url}: the actuators are those of {', '.join(driven)}; there must be one for each joint, in the "
            f"order of the joints, {', '.join(names)}"
        )
    return moving


def _check_limits(url: str, joint: Any, kind: str) -> None:
    lower, upper = (getattr(joint, f"{kind}_{side}_limits")() for side in ("lower", "upper"))
    if not (np.isfinite([lower[0], upper[0]]).all() and lower[0] < upper[0]):
        raise DrakeTrackerError(
            f"{url}: joint {joint.name()} has the {kind} limits {lower[0]:g} to {upper[0]:g}; they must be finite, the "
            "lower one below the upper one"
        )


def _check_values(arm: ArmDescription, joints: Sequence[Any]) -> None:
    """Checks the numbers of a description: one for each joint, positive gains, and a start within the limits."""
    for name in ("servo_inertia", "servo_bandwidth", "q_start"):
        values = np.asarray(getattr(arm, name), dtype=float)
        if values.shape != (len(joints),):
            raise DrakeTrackerError(f"{name} has {values.size} values for {len(joints)} joints with actuators")
        if name == "q_start":
            lower, upper = (
                np.array([getattr(joint, f"position_{side}_limits")()[0] for joint in joints])
                for side in ("lower", "upper")
            )
            wrong = ~((values > lower) & (values < upper))
            rule = "within the position limits"
        else:
            wrong, rule = ~((values > 0.0) & np.isfinite(values)), "above 0"
        if wrong.any():
            first = int(np.argmax(wrong))
            allowed = f", {lower[first]:g} to {upper[first]:g} rad" if name == "q_start" else ""
            raise DrakeTrackerError(
                f"{name} is {values[first]:g} for joint {joints[first].name()}; it must be {rule}{allowed}"
            )
