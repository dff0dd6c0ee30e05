from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.core.colour import hue, hue_distance
from drake_tracker.core.errors import DrakeTrackerError, PartError
from drake_tracker.core.messages import TrackState
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.target import (
    REASONS,
    TARGETS,
    Reason,
    choose_target,
    make_target_rule,
    reason_of,
)
from drake_tracker.vision.silhouettes.target_config import Coloured, First, Inside, Largest, Nearest
from drake_tracker.vision.silhouettes.track_3d import Measurement, new_track

GOLD, RED, GREY, BLUE = (208.0, 176.0, 64.0), (180.0, 40.0, 30.0), (120.0, 122.0, 119.0), (40.0, 60.0, 200.0)


def track(number, position=(0.56, 0.0, 0.48), colour=GREY, size=(0.1, 0.04, 0.05), seen=True):
    measurement = Measurement(np.array(position), 1e-6 * np.eye(3), 0.001, 1.0)
    shape = ObjectShape(np.array(size), 0.0, np.eye(3), np.zeros(3))
    begun = replace(new_track(1.0, measurement, shape, colour), number=number)
    return begun if seen else replace(begun.predicted(1.5), state=TrackState.NOT_OBSERVED)


class Easternmost:
    """A rule of a user: the object of the largest x, if it is east of a line."""

    reason = Reason.NO_MATCH

    def __init__(self, line):
        self._line = line

    def choose(self, tracks):
        best = max(tracks, key=lambda track: track.position[0])
        return best if best.position[0] > self._line else None


RULES = [First(), Largest(), Nearest(), Inside(), Coloured(), Easternmost(line=0.1)]


def name_of(value):
    return type(value).__name__


def choose(target, tracks, current=0):
    return choose_target(make_target_rule(target), tracks, current)


@pytest.mark.parametrize("target", RULES, ids=name_of)
def test_without_tracks_there_is_no_target(target):
    assert choose(target, [], 0) == choose(target, [], 3) == 0


@pytest.mark.parametrize("target", RULES, ids=name_of)
def test_a_target_is_kept_while_its_track_lives(target):
    better = track(1, colour=GOLD, size=(0.3, 0.3, 0.3))
    worse = track(2, (0.2, 0.5, 0.48), BLUE, seen=False)
    assert choose(target, [better, worse], 2) == 2
    assert choose(target, [better, worse], 7) == 1, "its track has ended"


@pytest.mark.parametrize("target", RULES, ids=name_of)
def test_an_object_that_is_not_seen_is_not_chosen(target):
    assert choose(target, [track(1, colour=GOLD, seen=False)], 0) == 0
    assert choose(target, [track(1, colour=GOLD, seen=False), track(4, colour=GOLD)], 0) == 4


def test_the_first():
    assert choose(First(), [track(3), track(5)]) == 3


def test_the_largest_by_volume():
    flat, cube = track(1, size=(0.2, 0.1, 0.01)), track(2, size=(0.08, 0.08, 0.08))
    assert choose(Largest(), [flat, cube]) == 2


def test_the_nearest_to_a_point_within_a_distance():
    tracks = [track(1, (0.5, 0.2, 0.48)), track(2, (0.5, -0.1, 0.48))]
    assert choose(Nearest(point=(0.5, 0.0, 0.48)), tracks) == 2
    assert choose(Nearest(point=(0.5, 0.0, 0.48), within=0.05), tracks) == 0
    assert choose(Nearest(point=(0.5, 0.15, 0.48), within=0.06), tracks) == 1


def test_the_first_inside_a_box():
    tracks = [track(1, (0.5, 0.2, 0.48)), track(2, (0.5, -0.1, 0.48)), track(3, (0.6, -0.1, 0.48))]
    box = ((0.4, -0.2, 0.4), (0.7, 0.0, 0.6))
    assert choose(Inside(box), tracks) == 2
    assert choose(Inside(box), tracks[:1]) == 0


def test_the_one_of_a_colour():
    tracks = [track(1, colour=GREY), track(2, colour=RED), track(3, colour=GOLD)]
    assert choose(Coloured("#d0b040"), tracks) == 3
    assert choose(Coloured("#ff0000"), tracks) == 2
    assert choose(Coloured("#00ff00"), tracks) == 0, "none is near enough"
    assert choose(Coloured("#808080"), tracks) == 1, "grey is a colour too"


def test_a_rule_of_a_user_chooses_as_one_of_the_package():
    tracks = [track(1, (0.5, 0.2, 0.48)), track(2, (0.6, -0.1, 0.48)), track(3, (0.7, 0.0, 0.48), seen=False)]
    assert choose(Easternmost(line=0.55), tracks) == 2, "the third is not seen"
    assert choose(Easternmost(line=0.65), tracks) == 0


@pytest.mark.parametrize("text", ["gold", "d0b040", "#d0b04", "#d0b0400", "#d0b04g", "", "#d0b040\n", 3])
def test_a_colour_that_is_none_is_refused_by_name(text):
    with pytest.raises(DrakeTrackerError, match="target: colour is .*must be"):
        make_target_rule(Coloured(text))


@pytest.mark.parametrize(
    "settings",
    [Nearest((0.5, 0.0)), Nearest((0.5, 0.0, np.nan)), Nearest(within=-1.0), Inside(((0.7,), (0.4,))), Coloured("red")],
    ids=str,
)
def test_settings_that_cannot_be_used_are_refused(settings):
    with pytest.raises(DrakeTrackerError):
        make_target_rule(settings)


@pytest.mark.parametrize("target", ["first", None, First, np.zeros(3)], ids=str)
def test_what_is_no_rule_is_refused_with_the_kinds(target):
    with pytest.raises(DrakeTrackerError, match="target: kind is .*; allowed are coloured, first, inside"):
        make_target_rule(target)


@pytest.mark.parametrize("kind", TARGETS.makers)
def test_every_rule_is_made_from_its_own_settings(kind):
    rule = make_target_rule(kind())
    assert rule.settings == kind() and make_target_rule(rule) is rule


def test_hues():
    assert hue(GREY) is None and hue((0.0, 0.0, 0.0)) is None
    assert hue((255.0, 0.0, 0.0)) == 0.0 and hue((0.0, 0.0, 10.0)) == pytest.approx(240.0)
    dark = tuple(0.3 * value for value in GOLD)
    assert hue(dark) == pytest.approx(hue(GOLD)), "shade does not change a hue"
    assert hue_distance(350.0, 10.0) == hue_distance(10.0, 350.0) == pytest.approx(20.0)
    assert hue_distance(None, None) == 0.0 and hue_distance(None, 90.0) == 180.0


@pytest.mark.parametrize(
    ("state", "reason"),
    [
        (TrackState.OCCLUDED, Reason.OCCLUDED),
        (TrackState.OUT_OF_VIEW, Reason.OUT_OF_VIEW),
        (TrackState.NOT_OBSERVED, Reason.NOT_OBSERVED),
    ],
)
def test_why_there_is_no_point_of_a_target(state, reason):
    lost = replace(track(1, seen=False), state=state)
    assert reason_of(lost, True, True) == reason
    assert reason_of(lost, True, False) == Reason.UNUSABLE_IMAGE


def test_why_there_is_no_target():
    assert reason_of(None, False, True) == Reason.NO_OBJECT
    assert reason_of(None, True, True) == Reason.NO_MATCH
    assert reason_of(track(1), True, True) == Reason.NONE
    assert set(REASONS) == set(Reason) and len(set(REASONS.values())) == len(Reason)


class Own:
    """A rule that returns what it was made with."""

    reason = Reason.NO_MATCH

    def __init__(self, answer):
        self.answer = answer

    def choose(self, tracks):
        return self.answer(tracks)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda tracks: tracks[0].number, "Own.choose returned a int that is none of the tracks"),
        (lambda tracks: track(9), "Own.choose returned a Track3D that is none of the tracks"),
        (lambda tracks: tracks[5], r"Own.choose raised IndexError: .* \(test_target.py line \d+\)"),
    ],
)
def test_a_rule_that_chooses_something_else_is_named(answer, message):
    with pytest.raises(PartError, match=f"^{message}"):
        choose(Own(answer), [track(1), track(2)])
