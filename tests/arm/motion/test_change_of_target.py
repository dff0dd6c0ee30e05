"""Packets jump from one object to another: the hand approaches the other object as it approached the first one."""

from functools import cache

import numpy as np
import pytest
from arm_computer import ArmComputer

from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, TARGET_STRIDE, pack_prediction
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.train.schema import Phase

LAG, RADIUS, RATE = 0.25, 0.12, 1.25
NEVER, BEFORE_LAUNCH, DESCENDING = np.inf, 1.95, 2.10
"""When the packets change [s]; with the first object alone, the hand is sent down at 1.98 s."""
APARTS = (0.15, 0.24, 0.26, 0.4, 1.0, np.pi)
"""Angles between the two objects on their circle [rad]: 2 to 24 cm."""


def packet(stamp, seq, angle):
    """A packet about an object on a circle, perfect but for its angle [rad]."""
    a = RATE * (stamp + KNOT_SPACING * np.arange(KNOT_COUNT)) + angle
    columns = np.broadcast_arrays(0.56 + RADIUS * np.cos(a), RADIUS * np.sin(a), 0.485, a + np.pi / 2, 0.002)
    return pack_prediction(stamp, seq, np.column_stack(columns))


@cache
def arm():
    return ArmComputer()


@cache
def run(change, apart=0.0):
    """Logs of the arm's computer; from ``change`` [s] on, the packets are about another object."""

    def make(now, number):
        other = now >= change
        if now < LAG:
            return np.zeros_like(packet(0.0, 0, 0.0))
        return packet(now - LAG, TARGET_STRIDE * (1 + other) + number, apart * other)

    return arm().run(make, 5.0)


def launches(logs):
    times, commands = logs["command"]
    phases = commands[:, 0]
    return times[1:][(phases[1:] == Phase.INTERCEPT) & (phases[:-1] != Phase.INTERCEPT)]


def jerkiness(logs):
    """Largest change of the commanded tool's step from one period to the next [m]."""
    return np.linalg.norm(np.diff(logs["status"][1][:, 3:6], 2, axis=0), axis=1).max()


@pytest.mark.parametrize("apart", APARTS)
def test_the_set_point_does_not_jump_and_the_joints_keep_their_limits(apart):
    logs = run(BEFORE_LAUNCH, apart)
    assert jerkiness(logs) <= 1.05 * jerkiness(run(NEVER)), "no worse than the first approach"
    speeds = np.abs(np.diff(logs["q_commanded"][1], axis=0)) / SERVO_PERIOD
    assert (speeds <= arm().model.velocity_limit).all()
    x, y = logs["target"][1][-1, 1:3] - [0.56, 0.0]
    due = logs["target"][1][-1, 0]
    assert np.cos(np.arctan2(y, x) - RATE * due - apart) > 0.999, "the other object is followed in the end"


@pytest.mark.parametrize("apart", APARTS)
def test_the_other_object_must_pass_the_same_gates_as_the_first(apart):
    first, second = launches(run(NEVER))[0], launches(run(BEFORE_LAUNCH, apart))[0]
    assert first == pytest.approx(1.98, abs=0.05), "the change comes just before the launch"
    tracked = run(NEVER)["command"]
    began = tracked[0][np.argmax(tracked[1][:, 0] == Phase.TRACK)]
    assert second - BEFORE_LAUNCH >= first - began - 0.01


@pytest.mark.parametrize("apart", APARTS)
def test_a_hand_that_descends_does_not_turn_to_another_object(apart):
    kept, changed = run(NEVER), run(DESCENDING, apart)
    times, commands = kept["command"]
    blind = (times > DESCENDING) & (commands[:, 5] > 0)
    until = times[blind][np.argmax(np.diff(times[blind], append=np.inf) > 1.5 * SERVO_PERIOD)]
    assert until > DESCENDING + 1.0
    for name in ("q_commanded", "command", "target"):
        same = kept[name][0] < until
        np.testing.assert_array_equal(kept[name][1][same], changed[name][1][same])
