"""Tests of latency in simulated time: when an action takes effect, and what a busy policy may do."""

import time

import numpy as np
import pytest

from drake_tracker.environments.environment import TrackerEnvironment
from drake_tracker.environments.latency import ActionLine

PERIOD = 0.03
UP = np.array([0.56, 0.0, 0.72, np.pi, 0.088])


def make(**settings):
    env = TrackerEnvironment(overrides=["vision=!Measured {}"], **settings)
    env.reset(seed=1)
    return env


def goals(env, steps, action=UP):
    """Returns the z [m] of the goal of the hand after each step, and ``info``."""
    found = []
    for _ in range(steps):
        *_, info = env.step(action)
        found.append((float(env._loop.read("status")[5]), info))
    return found


def first_move(env, steps=15):
    """Returns after how many periods the goal of the hand has first moved."""
    z = [z for z, _ in goals(env, steps)]
    return next(k for k, each in enumerate(z) if abs(each - UP[2]) < 1e-6)


def line(**settings):
    return ActionLine(settings.get("link_delay", 0.0), settings.get("pipelined", False), np.zeros(6))


def test_a_command_takes_effect_after_inference_and_link():
    actions = line(link_delay=0.05)
    actions.request(1.0, 0.1, np.ones(6))
    assert actions.busy(1.09) and not actions.busy(1.1)
    assert not actions.in_effect(1.149).any() and actions.in_effect(1.15).all()


def test_an_older_command_never_replaces_a_newer_one():
    actions = line(pipelined=True)
    actions.request(1.0, 0.5, np.full(6, 1.0))
    actions.request(1.1, 0.1, np.full(6, 2.0))
    assert not actions.busy(1.15)
    assert actions.in_effect(1.2)[0] == actions.in_effect(2.0)[0] == 2.0


@pytest.mark.parametrize(
    "settings, periods",
    [({}, 0), ({"link_delay": 0.06}, 2), ({"inference_time": 0.1}, 4), ({"inference_time": 0.1, "link_delay": 0.1}, 7)],
)
def test_an_action_takes_effect_when_its_time_has_passed(settings, periods):
    assert first_move(make(**settings)) == periods


def test_a_busy_policy_is_refused_while_the_world_moves_on():
    found = goals(make(inference_time=0.1), 8)
    assert [info["busy"] for _, info in found] == [True, True, True, False] * 2
    assert [info["refused"] for _, info in found] == [False, True, True, True] * 2


def test_a_pipelined_policy_is_never_busy():
    found = goals(make(inference_time=0.1, pipelined=True), 8)
    assert not any(info["busy"] or info["refused"] for _, info in found)
    assert abs(found[4][0] - UP[2]) < 1e-6 < abs(found[3][0] - UP[2])


def test_a_busy_policy_gets_all_measurements_afterwards():
    env = make(inference_time=0.1)
    for _ in range(4):
        observation, *_ = env.step(UP)
    seen = observation["seen"][observation["seen"] > 0.0]
    assert len(seen) in (7, 8)
    np.testing.assert_allclose(np.diff(seen), 1 / 60, atol=1e-9)


def test_the_inference_time_can_be_drawn_or_come_with_the_action():
    drawn = make(inference_time=lambda generator: generator.uniform(0.05, 0.2))
    first = [info["busy"] for _, info in goals(drawn, 30)]
    drawn.reset(seed=1)
    assert [info["busy"] for _, info in goals(drawn, 30)] == first and 5 < sum(first) < 28
    given = make(inference_time="action")
    assert given.action_space.shape == (6,)
    assert [info["busy"] for _, info in goals(given, 4, np.array([*UP, 0.07]))] == [True, True, False, True]


def test_wall_time_is_marked():
    env = make(inference_time="wall")
    time.sleep(0.1)
    *_, info = env.step(UP)
    assert info["busy"] and not info["reproducible"]


@pytest.mark.parametrize("cycles", [1, 6])
def test_the_camera_lag_is_the_age_of_the_points(cycles):
    env = make(camera_lag=cycles / 60)
    for _ in range(30):
        observation, *_ = env.step(None)
    valid = observation["point"][:, 5] > 0.0
    assert valid.any()
    ages = observation["seen"][valid] - observation["point"][valid, 0]
    np.testing.assert_allclose(ages, cycles / 60, atol=1e-3)
