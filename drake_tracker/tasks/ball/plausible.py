"""Settings of the ball that are allowed one by one, but with which no catch can succeed."""

from typing import TYPE_CHECKING

from drake_tracker.tasks.plausible import Problems, lag_of, link_problems, set_by_user

if TYPE_CHECKING:
    from drake_tracker.tasks.ball.scenario import BallScenario

RAISED_MARGIN = 0.02
"""Least height by which the cup is raised with the ball [m]."""


def catch_problems(scenario: "BallScenario") -> Problems:
    """Returns the settings of the catch that contradict vision, the link, or each other.

    Args:
        scenario: of the ball.
    """
    catch, lag = scenario.catch, lag_of(scenario.vision.throughput_cycles)
    found = link_problems(scenario, scenario.link, "vision.throughput_cycles", lag)
    if catch.raised_height < catch.rim_height + RAISED_MARGIN:
        key = set_by_user(scenario, ["catch.raised_height", "catch.rim_height"])
        found.append(
            (
                key,
                f"must raise the cup: catch.raised_height is {catch.raised_height:g} m, catch.rim_height "
                f"{catch.rim_height:g} m, at least {RAISED_MARGIN:g} m apart",
            )
        )
    if not found and lag >= catch.trust_time:
        key = set_by_user(scenario, ["catch.trust_time", "vision.throughput_cycles"])
        found.append(
            (
                key,
                f"leaves no prediction to trust: each is {lag:.3g} s old when it arrives, and catch.trust_time is "
                f"{catch.trust_time:g} s",
            )
        )
    return found
