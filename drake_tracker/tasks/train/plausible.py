"""Settings of the train that are allowed one by one, but with which no grasp can succeed."""

from typing import TYPE_CHECKING

from drake_tracker.core.timing import PATH_DURATION
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.jaws import GRIP_CONFIRMED, WIDTH_TOLERANCE
from drake_tracker.tasks.plausible import Problems, lag_of, set_by_user
from drake_tracker.world.config import LIFTED, TRAIN_WIDTH

if TYPE_CHECKING:
    from drake_tracker.tasks.train.scenario import TrainScenario

JAW_MARGIN = 0.010
"""Least width that the open jaws leave beside the object, on both sides together [m]."""
LIFT_MARGIN = 0.005
"""Height that the lift must exceed `LIFTED` by, because an arm with a load sags [m]."""


def grasp_problems(scenario: "TrainScenario") -> Problems:
    """Returns the settings of the grasp that contradict the object, the judge, or each other.

    Args:
        scenario: of the train.
    """
    grasp = scenario.grasp
    found: Problems = []
    if grasp.object_width <= WIDTH_TOLERANCE:
        found.append(
            (
                "grasp.object_width",
                f"must be above {WIDTH_TOLERANCE:g} m, or jaws that closed on nothing would count as a grip",
            )
        )
    width = max(grasp.object_width, TRAIN_WIDTH)
    if grasp.jaw_opening < width + JAW_MARGIN:
        key = set_by_user(scenario, ["grasp.jaw_opening", "grasp.object_width"])
        found.append(
            (
                key,
                f"leaves the jaws too narrow: they open to {grasp.jaw_opening:g} m, and an object of {width:g} m needs "
                f"{width + JAW_MARGIN:g} m",
            )
        )
    if grasp.closing_lead > grasp.descent_duration:
        key = set_by_user(scenario, ["grasp.closing_lead", "grasp.descent_duration"])
        found.append(
            (
                key,
                f"lets the jaws close before the descent begins: grasp.closing_lead is {grasp.closing_lead:g} s, "
                f"grasp.descent_duration {grasp.descent_duration:g} s",
            )
        )
    needed = LIFTED + LIFT_MARGIN + grasp.grasp_height
    if grasp.lift_height < needed:
        found.append(
            (
                "grasp.lift_height",
                f"must be at least {needed:g} m: the object counts as lifted from {LIFTED:g} m above its track",
            )
        )
    closing = touch_delay(grasp) + GRIP_CONFIRMED
    if grasp.close_timeout <= closing:
        key = set_by_user(scenario, ["grasp.close_timeout", "grasp.jaw_speed"])
        found.append(
            (key, f"gives the jaws {grasp.close_timeout:g} s, but they need {closing:.3g} s to close and grip")
        )
    return found + _blind_time_problems(scenario)


def _blind_time_problems(scenario: "TrainScenario") -> Problems:
    """Returns a problem when a predicted path ends before the jaws would touch the object."""
    grasp, lag = scenario.grasp, lag_of(scenario.vision.lag_cycles)
    descent = grasp.descent_duration - grasp.closing_lead + touch_delay(grasp)
    if lag + descent <= PATH_DURATION:
        return []
    keys = ["vision.lag_cycles", "grasp.jaw_speed", "grasp.descent_duration"]
    return [
        (
            set_by_user(scenario, keys),
            f"leaves no time for a grasp: a packet predicts {PATH_DURATION:g} s from its image on, of which vision "
            f"takes {lag:.3g} s, descent and closing {descent:.3g} s",
        )
    ]
