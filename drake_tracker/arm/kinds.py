"""The registry of the arms."""

from drake_tracker.arm.config import HandKind, Puma560, SevenJoint, UR5e
from drake_tracker.arm.description import (
    PUMA560,
    PUMA560_CUP,
    PUMA560_MARKED,
    SEVEN_JOINT,
    UR5E,
    ArmDescription,
)
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.registry import Registry


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
