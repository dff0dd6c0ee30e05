"""Which arm and hand a scenario means."""

from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT

WITH_GRIPPER = {"Puma560": PUMA560}
WITH_CUP = {"Puma560": PUMA560_CUP, "SevenJoint": SEVEN_JOINT}


def arm_of(scenario):
    """Returns the `ArmDescription` of a scenario: its arm by the YAML tag, with the hand that its task needs."""
    arms = WITH_GRIPPER if scenario.task == "train" else WITH_CUP
    return arms[type(scenario.arm).__name__]
