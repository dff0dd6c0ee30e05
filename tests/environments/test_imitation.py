"""The policy of `benchmarks/imitation.py`: what its network sees, and what becomes of its answers."""

import imitation
import numpy as np
import pytest

TIMES = np.arange(40) / 60.0


def path(angle=0.0, at=(0.56, 0.0)):
    """Rows (stamp, x, y, z) of an arc that begins at a place in a direction [rad]."""
    turn = angle + 0.8 * TIMES
    x, y = (at[k] + 0.15 * np.cumsum(f(turn)) / 60.0 for k, f in enumerate((np.cos, np.sin)))
    return np.column_stack([TIMES, x, y, np.full(40, 0.485)])


def tool_at(angle, at, place=(0.01, -0.02, 0.6, 0.3)):
    """A pose of the tool relative to the beginning of `path`."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z, yaw = place
    return np.array([at[0] + c * x - s * y, at[1] + s * x + c * y, z, yaw + angle])


@pytest.mark.parametrize(("angle", "at"), [(0.7, (0.5, 0.1)), (3.0, (0.6, -0.2))])
def test_the_network_sees_the_same_wherever_the_path_lies(angle, at):
    here, there = imitation.Imitation(), imitation.Imitation()
    seen = here.inputs(1.0, path(), tool_at(0.0, (0.56, 0.0)), 0.08)
    np.testing.assert_allclose(there.inputs(1.0, path(angle, at), tool_at(angle, at), 0.08), seen, atol=1e-12)
    target = here.target([*tool_at(0.0, (0.56, 0.0), (0.03, 0.01, 0.5, 0.1)), 0.088])
    np.testing.assert_allclose(there.target([*tool_at(angle, at, (0.03, 0.01, 0.5, 0.1)), 0.088]), target, atol=1e-12)


def observation(width, now=1.0):
    tracks = np.zeros((40, 10))
    tracks[:, [0, 7, 8, 9]], tracks[:, 4] = path(), 1.0
    tool = tool_at(0.0, (0.56, 0.0))
    return {"time": [now], "tool": tool, "jaws": [width, 0.0, 0.0], "tracks": tracks, "seen": np.ones(40)}


def test_the_answers_of_the_network_become_actions():
    wanted = [0.60, 0.03, 0.52, 0.4, 0.088]
    policy = imitation.Imitation(lambda seen: policy.target(wanted), heights=(0.48, 0.71))
    np.testing.assert_allclose(policy.act(observation(0.088)), wanted, atol=1e-9)
    wanted[2] = 0.3
    assert policy.act(observation(0.088))[2] == 0.48, "not below the lowest height of the data set"


def test_jaws_that_closed_on_nothing_open_and_go_up():
    policy = imitation.Imitation(lambda seen: policy.target([0.60, 0.03, 0.52, 0.4, 0.0]), heights=(0.48, 0.71))
    assert policy.act(observation(0.05))[4] == 0.0, "something is between the jaws"
    empty = policy.act(observation(0.01))
    assert (empty[2], empty[4]) == (imitation.HOVER, imitation.OPEN)
    assert policy.act(observation(0.08, now=1.5))[4] == imitation.OPEN
    assert policy.act(observation(0.08, now=2.0))[4] == 0.0
    policy.reset()
    assert policy.act(observation(0.08, now=1.5))[4] == 0.0


def test_before_the_first_measurement_the_tool_stays_with_open_jaws():
    blind = observation(0.088)
    blind["seen"] = np.zeros(40)
    np.testing.assert_array_equal(imitation.Imitation().act(blind), [*blind["tool"], imitation.OPEN])
