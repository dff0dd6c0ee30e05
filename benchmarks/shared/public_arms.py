"""Arms that the package does not have, for `success_law.py`. The kind ``!Custom`` calls these functions by name."""

import sysconfig
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from drake_tracker.arm.description import FINGERS, PUMA560, SEVEN_JOINT, ArmDescription

PANDA = "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
"""File of the package ``example-robot-data`` 6.0.0 on PyPI."""
_GRIPPER = {
    "gripper_url": PUMA560.gripper_url,
    "fingers": FINGERS,
    "finger_stiffness": PUMA560.finger_stiffness,
    "finger_damping": PUMA560.finger_damping,
}


def seven_with_jaws() -> ArmDescription:
    """Returns the arm with seven joints that catches the ball, with the gripper."""
    return replace(SEVEN_JOINT, **_GRIPPER)


def panda() -> ArmDescription:
    """Returns the Panda with the gripper, on a pedestal of 0.3 m."""
    return ArmDescription(
        arm_url=_without_hand(),
        base_link="panda_link0",
        flange="panda_link8",
        hand_link=PUMA560.hand_link,
        tool_frame=PUMA560.tool_frame,
        servo_inertia=(2.0, 2.5, 1.2, 1.0, 0.2, 0.2, 0.1),
        servo_bandwidth=(60.0, 60.0, 60.0, 60.0, 40.0, 40.0, 40.0),
        q_start=(0.0, -0.4, 0.0, -2.2, 0.0, 1.8, 0.785),
        base_height=0.3,
        **_GRIPPER,
    )


@lru_cache(maxsize=1)
def _without_hand() -> str:
    """Returns the URL of a copy of the Panda's file without its hand and what Drake does not read."""
    path = Path(sysconfig.get_path("purelib")) / PANDA
    if not path.is_file():
        raise FileNotFoundError(f"{path} is missing; python -m pip install example-robot-data==6.0.0")
    robot = ET.parse(path).getroot()
    for element in list(robot):
        name = element.get("name", "")
        if name.startswith(("panda_hand", "panda_leftfinger", "panda_rightfinger", "panda_finger")):
            robot.remove(element)
        for part in [part for tag in ("visual", "collision", "safety_controller") for part in element.findall(tag)]:
            element.remove(part)
    copy = Path(tempfile.mkdtemp(prefix="panda-")) / "panda.urdf"
    ET.ElementTree(robot).write(copy)
    return copy.as_uri()
