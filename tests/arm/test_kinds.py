import subprocess
import sys
import typing
from dataclasses import replace

import pytest

from drake_tracker.arm.config import HandKind, Puma560, SevenJoint, UR5e
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E, Arm
from drake_tracker.arm.kinds import ARMS, arms_without, make_arm
from drake_tracker.core.errors import DrakeTrackerError


@pytest.mark.parametrize(
    "settings, hand, expected",
    [
        (Puma560(), HandKind.GRIPPER, PUMA560),
        (Puma560(), HandKind.CUP, PUMA560_CUP),
        (SevenJoint(), HandKind.CUP, SEVEN_JOINT),
        (UR5e(), HandKind.GRIPPER, UR5E),
    ],
)
def test_an_arm_is_chosen_by_its_settings_and_the_hand_of_the_task(settings, hand, expected):
    arm = make_arm(settings, hand=hand)
    assert arm is expected and arm.hand is hand
    assert isinstance(arm, Arm)


def test_a_hand_that_an_arm_does_not_have_is_refused():
    with pytest.raises(DrakeTrackerError, match="the arm SevenJoint has no gripper; it has a cup"):
        make_arm(SevenJoint(), hand=HandKind.GRIPPER)
    with pytest.raises(DrakeTrackerError, match="arm: kind is .*; allowed are puma560, seven_joint, ur5e"):
        make_arm(PUMA560, hand=HandKind.CUP)


def test_the_hand_follows_from_the_fingers():
    assert replace(PUMA560, fingers=()).hand is HandKind.CUP


def test_a_task_offers_the_arms_that_have_its_hand():
    assert arms_without(HandKind.GRIPPER) == (SevenJoint,) and arms_without(HandKind.CUP) == (UR5e,)
    assert set(typing.get_args(ARMS.union(int, without=arms_without(HandKind.GRIPPER)))) == {Puma560, UR5e, int}


def test_settings_and_descriptions_do_not_load_drake():
    names = "HandKind, Puma560, ServoConfig, PUMA560"
    code = f"import sys; from drake_tracker.arm import {names}; assert 'pydrake' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
