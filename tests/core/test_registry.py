"""The registry of a role: the one place where a kind is added."""

import typing
from dataclasses import dataclass

import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.registry import Registry, snake_case


@dataclass(frozen=True)
class Round:
    radius: float = 1.0


@dataclass(frozen=True)
class LongBox:
    length: float = 2.0


def make_box(settings, *, colour="red"):
    return ("box", settings.length, colour)


KINDS = Registry("shape", {Round: lambda settings: ("round", settings.radius), LongBox: f"{__name__}:make_box"})


def test_names_are_those_of_the_tags_in_lower_case():
    assert list(KINDS.names) == ["round", "long_box"]
    assert snake_case("Puma560") == "puma560" and snake_case("AlphaBetaGamma") == "alpha_beta_gamma"


def test_a_maker_gets_only_what_it_accepts():
    assert KINDS.make(Round(3.0), colour="blue") == ("round", 3.0)
    assert Registry("shape", {LongBox: make_box}).make(LongBox(), colour="blue") == ("box", 2.0, "blue")


def test_parameters_of_a_name_are_settings_or_keywords_of_the_maker():
    kinds = Registry("shape", {LongBox: make_box})
    assert kinds.make_by_name("long_box", length=5.0, colour="green") == ("box", 5.0, "green")
    with pytest.raises(DrakeTrackerError, match="long_box has no parameter 'width'; it has length, colour"):
        kinds.make_by_name("long_box", width=1.0)


def test_a_maker_is_imported_when_it_is_first_needed():
    kinds = Registry("error", {Round: "drake_tracker.core.errors:raised", LongBox: "no.such.module:at_all"})
    assert kinds.maker(Round).__name__ == "raised"


def test_what_is_of_no_kind_is_refused():
    for attempt in (lambda: KINDS.make(3), lambda: KINDS.make_by_name("cone"), lambda: KINDS.maker(int)):
        with pytest.raises(DrakeTrackerError, match="shape: kind is .*; allowed are long_box, round"):
            attempt()


def test_the_union_offers_all_kinds_but_those_left_out():
    assert set(typing.get_args(KINDS.union(int))) == {Round, LongBox, int}
    assert set(typing.get_args(KINDS.union(int, without=(Round,)))) == {LongBox, int}
