"""Tests of the rules that a dispatcher of one's own must follow."""

from types import SimpleNamespace

import pytest

from drake_tracker.core.errors import PartError
from drake_tracker.dispatch.dispatcher import Plan, choose_plan

PARTS = [SimpleNamespace(number=number) for number in (3, 7)]


class Own:
    """A dispatcher that returns what it was made with."""

    def __init__(self, answer):
        self.answer = answer

    def choose(self, hand, candidates, cells, now):
        return self.answer(candidates) if callable(self.answer) else self.answer


@pytest.mark.parametrize("plan", [Plan(), Plan((7,), (1.0,)), Plan((7, 3), (1.0, 2.0))])
def test_a_plan_of_candidates_is_used(plan):
    assert choose_plan(Own(plan), None, PARTS, [], 0.0) is plan


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "Own.choose returned a NoneType; it must return a Plan"),
        (7, "Own.choose returned a int; it must return a Plan"),
        (Plan((5,), (1.0,)), r"Own.choose planned \(5,\); these must be candidates"),
        (Plan((3, 7), (1.0,)), r"Own.choose planned \(3, 7\); these must be candidates, each with a pick time"),
        (lambda parts: parts[2], r"Own.choose raised IndexError: .* \(test_dispatcher.py line \d+\)"),
    ],
)
def test_what_is_no_plan_is_named(answer, message):
    with pytest.raises(PartError, match=f"^{message}"):
        choose_plan(Own(answer), None, PARTS, [], 0.0)
