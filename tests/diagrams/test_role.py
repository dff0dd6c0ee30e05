"""Tests of the check of a role, which calls nothing."""

import functools
import typing

import own_estimator
import pytest

from drake_tracker.arm.description import PUMA560, ArmDescription
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.custom import check_role
from drake_tracker.estimation.estimator import Estimator

if typing.TYPE_CHECKING:
    from drake_tracker.arm.description import ArmDescription as Arm


def never() -> typing.Any:
    raise AssertionError("it was called")


def makes_estimator() -> Estimator:
    return never()


def makes_estimator_of_a_state() -> Estimator[own_estimator.Newest]:
    return never()


def makes_its_own_class() -> own_estimator.StraightOn:
    return never()


def makes_arm() -> ArmDescription:
    return never()


def makes_arm_by_name() -> "ArmDescription":
    return never()


def makes_arm_of_a_module() -> "own_estimator.ArmDescription":
    return never()


def makes_arm_under_another_name() -> "Arm":
    return never()


def makes_a_number() -> int:
    return never()


def states_nothing():
    return never()


class IsAnArm(ArmDescription):
    def __init__(self):
        never()


@pytest.mark.parametrize(
    ("make", "role"),
    [
        (own_estimator.StraightOn, Estimator),
        (makes_estimator, Estimator),
        (makes_estimator_of_a_state, Estimator),
        (makes_its_own_class, Estimator),
        (makes_arm, ArmDescription),
        (makes_arm_by_name, ArmDescription),
        (makes_arm_of_a_module, ArmDescription),
        (IsAnArm, ArmDescription),
        (ArmDescription, ArmDescription),
    ],
)
def test_what_makes_a_part_of_the_role_is_accepted(make, role):
    check_role(make, role, "mine.make")


@pytest.mark.parametrize(
    ("make", "role", "message"),
    [
        (
            own_estimator.WithoutStd,
            Estimator,
            "has no method predict_std; an estimator has initial_state, update, ready",
        ),
        (dict, Estimator, "has no method initial_state, ready, predict, predict_std"),
        (makes_arm, Estimator, "is annotated with -> ArmDescription; it must return an estimator, Estimator"),
        (makes_a_number, ArmDescription, "is annotated with -> int; it must return an arm, ArmDescription"),
        (makes_arm_under_another_name, ArmDescription, "is annotated with -> Arm; it must return an arm"),
        (makes_estimator, ArmDescription, "is annotated with -> Estimator"),
        (states_nothing, ArmDescription, "annotate it: def states_nothing(...) -> ArmDescription"),
        (lambda: never(), Estimator, "does not state what it returns"),
        (own_estimator.StraightOn, ArmDescription, "is a class that is no ArmDescription"),
        (print, Estimator, "is a builtin_function_or_method; an estimator is made by a class that is one, or by a"),
        (functools.partial(makes_arm), ArmDescription, "is a partial; an arm is made by"),
        (PUMA560, ArmDescription, "is a ArmDescription"),
    ],
)
def test_anything_else_is_refused_in_one_line(make, role, message):
    with pytest.raises(DrakeTrackerError) as caught:
        check_role(make, role, "mine.make")
    assert str(caught.value).startswith("mine.make ") and message in str(caught.value), caught.value
