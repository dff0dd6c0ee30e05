"""Makes the arm of a scenario, with the hand that its task needs."""

from typing import Any

from pydrake.multibody.plant import MultibodyPlant

from drake_tracker.arm.config import HandKind
from drake_tracker.arm.description import PROBE_FRAME, ArmDescription, make_arm
from drake_tracker.arm.plant import actuators_of, add_arm
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.custom import make_custom
from drake_tracker.scenarios.base import Custom

_DRIVES = {True: "one must drive the fingers", False: "a hand without fingers has none"}
_HANDS = {HandKind.GRIPPER: "fingers", HandKind.CUP: "no fingers, but a cup"}


def arm_of(scenario: Any) -> ArmDescription:
    """Returns the description of a scenario's arm, with the hand that its task needs.

    Args:
        scenario: a scenario with the setting ``arm`` and the attribute ``hand`` (a `HandKind`).

    Raises DrakeTrackerError when a custom arm is not allowed (see `drake_tracker.scenarios.consent`), cannot be made,
    or does not have that hand.
    """
    if not isinstance(scenario.arm, Custom):
        return make_arm(scenario.arm, hand=scenario.hand)
    where = scenario.where("arm")
    arm = make_custom(scenario.arm, where, ArmDescription)
    if not isinstance(arm, ArmDescription):
        raise DrakeTrackerError(
            f"{where}: {scenario.arm.call} returned a {type(arm).__name__}; it must return an ArmDescription"
        )
    if arm.has_fingers != (scenario.hand is HandKind.GRIPPER):
        raise DrakeTrackerError(
            f"{where}: {scenario.arm.call}: for the {scenario.task} the hand must have {_HANDS[scenario.hand]}"
        )
    try:
        check_arm(arm)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(f"{where}: {scenario.arm.call}: {error}") from None
    return arm


def check_arm(arm: ArmDescription) -> None:
    """Checks that the models of an arm agree with its description.

    Args:
        arm: the description.

    Raises DrakeTrackerError when a model, frame, joint or actuator that it names does not exist.
    """
    plant = MultibodyPlant(0.0)
    try:
        parts = add_arm(plant, description=arm)
        for frame in (arm.tool_frame, *(() if arm.has_fingers else (PROBE_FRAME,))):
            plant.GetFrameByName(frame, parts.gripper)
        for finger in arm.fingers:
            plant.GetJointByName(finger, parts.gripper)
    except (RuntimeError, ValueError) as error:  # Drake's message says what is missing
        raise DrakeTrackerError(" ".join(str(error).split())) from None
    drives = len(actuators_of(plant, parts.gripper))
    if drives != arm.has_fingers:
        raise DrakeTrackerError(f"{arm.gripper_url} has {drives} actuators; {_DRIVES[arm.has_fingers]}")
    if len(arm.fingers) not in (0, 2):
        raise DrakeTrackerError(f"fingers names {len(arm.fingers)} joints; a gripper has two, a cup none")
    joints = len(actuators_of(plant, parts.arm))
    for name in ("servo_inertia", "servo_bandwidth", "q_start"):
        if len(getattr(arm, name)) != joints:
            raise DrakeTrackerError(f"{name} has {len(getattr(arm, name))} values for {joints} joints with actuators")
