"""Which arm and hand a scenario means."""

from pydrake.multibody.plant import MultibodyPlant

from drake_tracker.arm.description import PROBE_FRAME, PUMA560, PUMA560_CUP, SEVEN_JOINT, ArmDescription, add_arm
from drake_tracker.arm.joint_servo import actuators_of
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.custom import make_custom
from drake_tracker.scenarios.base import Custom

_DRIVES = {True: "one must drive the fingers", False: "a hand without fingers has none"}
WITH_GRIPPER = {"Puma560": PUMA560}
WITH_CUP = {"Puma560": PUMA560_CUP, "SevenJoint": SEVEN_JOINT}


def arm_of(scenario):
    """Returns the `ArmDescription` of a scenario: its arm by the YAML tag, with the hand that its task needs.

    Raises DrakeTrackerError, one line, when the user's own cannot be made, or has not the hand of the task.
    """
    if not isinstance(scenario.arm, Custom):
        return (WITH_GRIPPER if scenario.task == "train" else WITH_CUP)[type(scenario.arm).__name__]
    where = scenario.where("arm")
    arm = make_custom(scenario.arm, where)
    if not isinstance(arm, ArmDescription):
        raise DrakeTrackerError(
            f"{where}: {scenario.arm.call} returned a {type(arm).__name__}; it must return an ArmDescription"
        )
    if arm.has_fingers != (scenario.task == "train"):
        hand = "fingers" if scenario.task == "train" else "no fingers, but a cup"
        raise DrakeTrackerError(f"{where}: {scenario.arm.call}: the hand of the {scenario.task} must have {hand}")
    try:
        check_arm(arm)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(f"{where}: {scenario.arm.call}: {error}") from None
    return arm


def check_arm(arm):
    """Raises DrakeTrackerError, one line, when the models of an `ArmDescription` are not as it says."""
    plant = MultibodyPlant(0.0)
    try:
        parts = add_arm(plant, arm)
        for frame in (arm.tool_frame, *(() if arm.has_fingers else (PROBE_FRAME,))):
            plant.GetFrameByName(frame, parts.gripper)
        for finger in arm.fingers:
            plant.GetJointByName(finger, parts.gripper)
    except (RuntimeError, ValueError) as error:  # of Drake, which names what is missing
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
