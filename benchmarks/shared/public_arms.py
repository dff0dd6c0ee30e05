"""Arms that the package does not have, for `success_law.py`. The kind ``!Custom`` calls these functions by name."""

import math
import sysconfig
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from drake_tracker.arm.description import FINGERS, PUMA560, SEVEN_JOINT, UR5E, ArmDescription


class PackagedFile(NamedTuple):
    """A file of a package on PyPI: the package with its version, and the path among the installed packages."""

    package: str
    path: str


PANDA = PackagedFile(
    "example-robot-data==6.0.0", "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
)
UR10 = PackagedFile(
    "example-robot-data==6.0.0", "cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur10_robot.urdf"
)
IIWA = PackagedFile("pybullet==3.2.7", "pybullet_data/kuka_iiwa/model.urdf")
IIWA_LIMITS = ((85, 320), (85, 320), (100, 176), (75, 176), (130, 110), (135, 40), (135, 40))
"""Speed [deg/s] and torque [N m] of each joint (KUKA, data sheet of the LBR iiwa 14 R820); the file has 10 rad/s and
300 N m for all."""
_GRIPPER = {
    "gripper_url": PUMA560.gripper_url,
    "fingers": FINGERS,
    "finger_stiffness": PUMA560.finger_stiffness,
    "finger_damping": PUMA560.finger_damping,
}
_ON_PEDESTAL = {
    "hand_link": PUMA560.hand_link,
    "tool_frame": PUMA560.tool_frame,
    "servo_inertia": (2.0, 2.5, 1.2, 1.0, 0.2, 0.2, 0.1),
    "servo_bandwidth": (60.0, 60.0, 60.0, 60.0, 40.0, 40.0, 40.0),
    "base_height": 0.3,
    **_GRIPPER,
}
"""What the arms of seven joints on a pedestal have in common; the servos are chosen."""


def seven_with_jaws() -> ArmDescription:
    """Returns the arm with seven joints that catches the ball, with the gripper."""
    return replace(SEVEN_JOINT, **_GRIPPER)


def panda() -> ArmDescription:
    """Returns the Panda with the gripper, on a pedestal of 0.3 m."""
    return ArmDescription(
        arm_url=_bare(PANDA, without=("panda_hand", "panda_leftfinger", "panda_rightfinger", "panda_finger")),
        base_link="panda_link0",
        flange="panda_link8",
        q_start=(0.0, -0.4, 0.0, -2.2, 0.0, 1.8, 0.785),
        **_ON_PEDESTAL,
    )


def iiwa() -> ArmDescription:
    """Returns the KUKA LBR iiwa 14 R820 with the gripper, on a pedestal of 0.3 m, with the limits of its data sheet."""
    return ArmDescription(
        arm_url=_bare(IIWA, limits=IIWA_LIMITS),
        base_link="lbr_iiwa_link_0",
        flange="lbr_iiwa_link_7",
        q_start=(0.0, 0.4, 0.0, -1.8, 0.0, 0.9, 0.0),
        **_ON_PEDESTAL,
    )


def ur10() -> ArmDescription:
    """Returns the UR10 with the gripper."""
    return replace(
        UR5E,
        arm_url=_bare(UR10, without=("world",)),
        base_link="base_link",
        flange="tool0",
        servo_inertia=(7.0, 9.0, 3.0, 0.5, 0.3, 0.2),
        q_start=(0.0, -1.5, 2.1, -2.2, -1.57, 0.0),
    )


@lru_cache
def _bare(file: PackagedFile, *, without: tuple[str, ...] = (), limits: tuple[tuple[float, float], ...] = ()) -> str:
    """Returns the URL of a copy of an arm's file, without some of its parts and what Drake does not read.

    Args:
        file: where it is.
        without: how the names of the parts begin that are left out.
        limits: (speed [deg/s], torque [N m]) of each joint, in place of the file's.

    Raises FileNotFoundError when the package is not installed.
    """
    path = Path(sysconfig.get_path("purelib"), file.path)
    if not path.is_file():
        raise FileNotFoundError(f"{path} is missing; python -m pip install --no-deps {file.package}")
    robot = ET.parse(path).getroot()
    for element in list(robot):
        if without and element.get("name", "").startswith(without):
            robot.remove(element)
        for part in [part for tag in ("visual", "collision", "safety_controller") for part in element.findall(tag)]:
            element.remove(part)
        if any(float(mass.get("value", "1")) == 0.0 for mass in element.findall("inertial/mass")):
            element.remove(element.find("inertial"))
    for limit, (speed, torque) in zip(robot.findall("joint/limit"), limits):
        limit.set("velocity", str(math.radians(speed)))
        limit.set("effort", str(torque))
    copy = Path(tempfile.mkdtemp(prefix="arm-")) / path.name
    ET.ElementTree(robot).write(copy)
    return copy.as_uri()
