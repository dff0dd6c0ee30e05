"""Tests of the rules that a link of one's own must follow."""

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.link.config import Lossy, Perfect
from drake_tracker.link.link import LINKS, check_link


@pytest.mark.parametrize("settings", [Perfect(), Lossy(drop=0.3, delay=0.02, jitter=0.05, burst=3)])
def test_the_links_of_the_package_follow_the_rules(settings):
    check_link(LINKS.make(settings, seed=1))


class Direct:
    def initial_state(self):
        return [None]

    def post(self, state, packet, now):
        return [packet]

    def delivered(self, state, now):
        return state[0]


class Remembers(Direct):
    """Counts the packets on itself, and loses every seventh."""

    count = 0

    def post(self, state, packet, now):
        self.count += 1
        return state if self.count % 7 == 0 else [packet]


class Changes(Direct):
    def __init__(self):
        self.kept = [None]

    def initial_state(self):
        return self.kept

    def post(self, state, packet, now):
        state[0] = packet
        return state


class Invents(Direct):
    def delivered(self, state, now):
        return state[0] + 1.0


class Breaks(Direct):
    def post(self, state, packet, now):
        return {}[now]


class Incomplete:
    def initial_state(self):
        return None


@pytest.mark.parametrize(
    ("link", "message"),
    [
        (Remembers(), "Remembers delivered other packets in the same run; all memory must be in the state"),
        (Changes(), "Changes changed a state that it had returned"),
        (Invents(), "Invents.delivered returned what was not offered"),
        (Breaks(), r"Breaks raised KeyError: .* \(test_check_link.py line \d+\)"),
        (Incomplete(), "Incomplete has no post, delivered; see Link"),
    ],
)
def test_a_link_that_breaks_a_rule_is_named(link, message):
    with pytest.raises(DrakeTrackerError, match=f"^{message}"):
        check_link(link)


def test_a_link_of_ones_own_passes():
    check_link(Direct())
    assert np.isfinite(Direct().delivered([np.ones(3)], 0.0)).all()
