"""Checks that the models of an arm meet the requirements of docs/how_to/arm.md, before anything runs."""

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint
from pydrake.planning import RobotDiagramBuilder

from drake_tracker.arm.description import PROBE_FRAME, ArmDescription
from drake_tracker.arm.plant import ArmParts, actuators_of, add_arm
from drake_tracker.core.errors import DrakeTrackerError

_LEAST_JOINTS = 6
"""Number of joints that a pose of the tool needs."""
_ALONG = 0.999
"""Least cosine between the axis of the last joint and the approach axis of a gripper."""
_DRIVES = {True: "one must drive the fingers", False: "a hand without fingers has none"}


def check_arm(arm: ArmDescription) -> None:
    """Checks that the models of an arm meet the requirements of the package, and agree with its description.

    Raises DrakeTrackerError, one line that names the file, the frame or the joint, and the value.
    """
    builder = RobotDiagramBuilder(time_step=0.0)
    plant = builder.plant()
    try:
        parts = add_arm(plant, description=arm)
        tool = plant.GetFrameByName(arm.tool_frame, parts.gripper)
        if not arm.has_fingers:
            plant.GetFrameByName(PROBE_FRAME, parts.gripper)
        fingers = [plant.GetJointByName(finger, parts.gripper) for finger in arm.fingers]
    except (RuntimeError, ValueError, TypeError, OSError, ElementTree.ParseError) as error:  # it says what is missing
        raise DrakeTrackerError(" ".join(str(error).split())) from None
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
        context = plant.CreateDefaultContext()
        last = joints[-1]
        axis_W = last.frame_on_child().CalcPoseInWorld(context).rotation() @ last.revolute_axis()
        approach_W = tool.CalcPoseInWorld(context).rotation().col(2)
        if abs(axis_W @ approach_W) < _ALONG:
            raise DrakeTrackerError(
                f"the axis of the last joint, {last.name()}, is {np.rad2deg(np.arccos(abs(axis_W @ approach_W))):.0f} "
                f"degrees from z of {arm.tool_frame}; it must turn the hand about its approach axis"
            )


def _check_hand(plant: MultibodyPlant, arm: ArmDescription, parts: ArmParts, fingers: Sequence[Joint]) -> None:
    drives = actuators_of(plant, parts.gripper)
    if len(drives) != arm.has_fingers:
        raise DrakeTrackerError(f"{arm.gripper_url} has {len(drives)} actuators; {_DRIVES[arm.has_fingers]}")
    if len(fingers) not in (0, 2):
        raise DrakeTrackerError(f"fingers names {len(fingers)} joints; a gripper has two, a cup none")
    for finger in fingers:
        if finger.type_name() != "prismatic":
            raise DrakeTrackerError(
                f"{arm.gripper_url}: {finger.name()} is {finger.type_name()}; fingers are prismatic"
            )
        _check_limits(arm.gripper_url, finger, "position")
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
    drives = {drive.joint().name(): drive for drive in actuators_of(plant, parts.arm)}
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
            raise DrakeTrackerError(f"{where} has no actuator; a URDF names it in a transmission")
        if not np.isfinite(drive.effort_limit()):
            raise DrakeTrackerError(f"{where} has no effort limit")
    if len(moving) < _LEAST_JOINTS:
        raise DrakeTrackerError(f"{arm.arm_url} has {len(moving)} joints; a pose of the hand needs {_LEAST_JOINTS}")
    names = [joint.name() for joint in moving]
    if list(drives) != names:
        raise DrakeTrackerError(
            f"{arm.arm_url}: the actuators are those of {', '.join(drives)}; they must be in the order of the joints, "
            f"{', '.join(names)}"
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
