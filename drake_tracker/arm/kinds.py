"""The kinds of arm. A new kind is registered here, and only here."""

from drake_tracker.arm.config import ArmSettings, Hand, Puma560, SevenJoint
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT, ArmDescription
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.kinds import Kinds


def puma560(settings: Puma560, *, hand: Hand) -> ArmDescription:
    """Returns the PUMA 560 with a hand."""
    return _with_hand("Puma560", (PUMA560, PUMA560_CUP), hand)


def seven_joint(settings: SevenJoint, *, hand: Hand) -> ArmDescription:
    """Returns the arm with seven joints with a hand."""
    return _with_hand("SevenJoint", (SEVEN_JOINT,), hand)


ARMS: Kinds[ArmDescription] = Kinds("arm", {Puma560: puma560, SevenJoint: seven_joint})
"""The kinds of arm; a maker takes the settings and the hand that the task needs."""


def make_arm(settings: ArmSettings, *, hand: Hand) -> ArmDescription:
    """Returns the description of an arm with a hand.

    Args:
        settings: an instance of one of the kinds in `ARMS`.
        hand: the hand that the task needs.

    Raises DrakeTrackerError for settings of no kind, or when the arm does not have this hand.
    """
    return ARMS.make(settings, hand=hand)


def _with_hand(name: str, descriptions: tuple[ArmDescription, ...], hand: Hand) -> ArmDescription:
    for description in descriptions:
        if description.hand is hand:
            return description
    known = " or ".join(description.hand.value for description in descriptions)
    raise DrakeTrackerError(f"the arm {name} has no {hand.value}; it has a {known}")
