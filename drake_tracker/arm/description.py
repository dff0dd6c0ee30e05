"""An arm with its hand, described once for the simulated world and for the controller's own model of the arm.

`ARMS` registers the arms.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_tracker.arm.config import HandKind, Puma560, SevenJoint, UR5e
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.registry import Registry

FINGERS = ("finger_left", "finger_right")
"""The gripper's prismatic joints. Each travels half the opening; the first is driven, the second is coupled to it."""
MARKERS = ("marker_left", "marker_right")
"""Links of a hand that are markers for cameras, one on each finger (`drake_tracker.vision.hand.hand_markers`)."""
PROBE_FRAME = "probe"
"""Frame of the cup: the centre of the spherical tip with which it touches the board's marks."""


@dataclass(frozen=True)
class ArmDescription:
    """Description of an arm with its hand.

    Attributes:
        arm_url: URL of the arm's model, ``package://drake_tracker_models/...`` or ``file://...``.
        gripper_url: URL of the hand's model.
        base_link: link of the arm's model that is welded to the world.
        flange: frame of the arm's model that carries the hand.
        hand_link: link of the hand's model that is welded to the flange.
        tool_frame: frame T of the hand's model between the pads or in the cup, z_T along the approach, y_T along the
            jaws' opening.
        servo_inertia: inertia for which each joint's servo is tuned [kg m^2].
        servo_bandwidth: bandwidth of each joint's servo [rad/s].
        finger_stiffness: proportional gain of the driven finger [N/m]; without effect for a hand without fingers.
        finger_damping: derivative gain of the driven finger [N s/m]; without effect for a hand without fingers.
        q_start: joint positions [rad] from which the home pose is searched, and near which a redundant arm stays.
        fingers: the hand's joints as in `FINGERS`; empty for a hand that cannot move, such as a cup.
        base_height: height of the base above the floor [m], for an arm on a pedestal.
        markers: whether the hand's model has the links `MARKERS`, by which cameras find the hand.
    """

    arm_url: str
    gripper_url: str
    base_link: str
    flange: str
    hand_link: str
    tool_frame: str
    servo_inertia: tuple[float, ...]
    servo_bandwidth: tuple[float, ...]
    finger_stiffness: float
    finger_damping: float
    q_start: tuple[float, ...]
    fingers: tuple[str, ...] = FINGERS
    base_height: float = 0.0
    markers: bool = False

    @property
    def has_fingers(self) -> bool:
        """Whether the hand has fingers that move."""
        return bool(self.fingers)

    @property
    def hand(self) -> HandKind:
        """The kind of hand: a gripper has fingers, a cup has none."""
        return HandKind.GRIPPER if self.fingers else HandKind.CUP


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
"""The PUMA 560 with the gripper."""

PUMA560_MARKED = replace(PUMA560, gripper_url="package://drake_tracker_models/gripper/gripper_marked.sdf", markers=True)
"""The PUMA 560 with the gripper, whose fingers carry markers."""

CUP: dict[str, Any] = {
    "gripper_url": "package://drake_tracker_models/cup/cup.sdf",
    "finger_stiffness": 0.0,
    "finger_damping": 0.0,
    "fingers": (),
}
"""The fields of an `ArmDescription` that describe the cup, a hand without fingers."""

PUMA560_CUP = replace(PUMA560, **CUP)
"""The PUMA 560 with the cup."""

SEVEN_JOINT = replace(
    PUMA560_CUP,
    arm_url="package://drake_tracker_models/seven_joint/seven_joint.sdf",
    servo_inertia=(12.0, 20.0, 6.0, 6.0, 0.5, 0.5, 0.4),
    servo_bandwidth=(50.0, 50.0, 50.0, 50.0, 40.0, 40.0, 40.0),
    q_start=(0.0, 0.05, 0.0, 2.15, 0.0, 0.95, 0.0),
)
"""The arm with seven joints with the cup."""

UR5E = replace(
    PUMA560,
    arm_url="package://drake_tracker_models/ur5e/ur5e.sdf",
    servo_inertia=(2.2, 3.2, 1.2, 0.2, 0.15, 0.12),
    servo_bandwidth=(60.0, 60.0, 60.0, 40.0, 40.0, 40.0),
    q_start=(0.0, -2.0, -1.8, -0.9, 0.5 * np.pi, 0.5 * np.pi),
)
"""An arm like the UR5e with the gripper."""


def puma560(settings: Puma560, *, hand: HandKind) -> ArmDescription:
    """Returns the PUMA 560 with a hand. Raises DrakeTrackerError for markers on a cup."""
    if settings.markers and hand is not HandKind.GRIPPER:
        raise DrakeTrackerError(f"arm.markers: the {hand.value} has no fingers that could carry markers")
    return _with_hand(settings, (PUMA560_MARKED if settings.markers else PUMA560, PUMA560_CUP), hand)


def seven_joint(settings: SevenJoint, *, hand: HandKind) -> ArmDescription:
    """Returns the arm with seven joints with a hand."""
    return _with_hand(settings, (SEVEN_JOINT,), hand)


def ur5e(settings: UR5e, *, hand: HandKind) -> ArmDescription:
    """Returns the arm like the UR5e with a hand."""
    return _with_hand(settings, (UR5E,), hand)


ARMS: Registry[ArmDescription] = Registry("arm", {Puma560: puma560, SevenJoint: seven_joint, UR5e: ur5e})
"""Every arm of the package by its settings; the one place where an arm is registered. A maker takes the settings and
the hand that the task needs."""


def make_arm(settings: object, *, hand: HandKind) -> ArmDescription:
    """Returns the description of an arm with a hand.

    Args:
        settings: settings of a kind in `ARMS`.
        hand: the hand that the task needs.

    Raises DrakeTrackerError for settings of no kind, or when the arm does not have this hand.
    """
    return ARMS.make(settings, hand=hand)


def arms_without(hand: HandKind) -> tuple[type, ...]:
    """Returns the kinds of arm that do not have a hand."""
    return tuple(kind for kind in ARMS.makers if not _has(kind, hand))


def _has(kind: type, hand: HandKind) -> bool:
    try:
        ARMS.make(kind(), hand=hand)
    except DrakeTrackerError:
        return False
    return True


def _with_hand(settings: object, descriptions: tuple[ArmDescription, ...], hand: HandKind) -> ArmDescription:
    for description in descriptions:
        if description.hand is hand:
            return description
    known = " or ".join(description.hand.value for description in descriptions)
    raise DrakeTrackerError(f"the arm {type(settings).__name__} has no {hand.value}; it has a {known}")
