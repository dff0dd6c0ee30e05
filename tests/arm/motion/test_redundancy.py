"""The seventh joint: the arm reaches the work, stays near its nominal joints, and the tool does not feel it."""

import itertools

import numpy as np
import pytest

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560, SEVEN_JOINT
from drake_tracker.arm.motion.differential_ik import joints_for, make_parameters, rotation_vector, step_joints

PERIOD = 0.005
Q_WOUND_UP = np.deg2rad([-34.0, 112.0, 153.0, 109.0, -102.0, 155.0, 53.0])
"""The tool is near the middle of the bottom edge, the elbow hangs low, joint 2 is 8 deg from its end."""


@pytest.fixture(scope="module")
def model():
    return make_arm_model(SEVEN_JOINT)


def margin(model, q):
    return min(np.min(q - model.position_lower), np.min(model.position_upper - q))


def along_the_edge(model, q, rate, laps=1):
    """Runs 0.3 m to both sides along the bottom edge. Returns margins [rad], the tool's worst errors [m], [rad], q."""
    parameters = make_parameters(model, PERIOD, rate)
    margins, worst = [], [0.0, 0.0]
    for k in range(600 * laps):
        X_WT_desired = tool_down([0.55, 0.3 * np.sin(2.0 * np.pi * k / 600), 0.55], np.pi)
        q, _ = step_joints(model, parameters, q, X_WT_desired)
        X_WT = model.tool_pose(q)
        turn = rotation_vector(X_WT.rotation() @ X_WT_desired.rotation().inverse())
        miss = X_WT.translation() - X_WT_desired.translation()
        worst = np.maximum(worst, [np.linalg.norm(miss), np.linalg.norm(turn)])
        margins.append(margin(model, q))
    return np.array(margins), worst, q


@pytest.fixture(scope="module")
def q_wound_up(model):
    parameters, goal = make_parameters(model, 0.05, 0.0), tool_down([0.55, 0.0, 0.55], np.pi)
    q = Q_WOUND_UP
    for _ in range(60):
        q, _ = step_joints(model, parameters, q, goal)
    assert model.tool_pose(q).IsNearlyEqualTo(goal, 1e-6) and margin(model, q) < np.deg2rad(12.0)
    return q


def test_it_reaches_the_whole_work_without_coming_near_a_limit(model):
    for x, y, z in itertools.product((0.40, 0.51, 0.62), (-0.35, 0.0, 0.35), (0.40, 0.575, 0.75)):
        q = joints_for(model, SEVEN_JOINT.q_start, tool_down([x, y, z], np.pi))
        assert margin(model, q) > np.deg2rad(20.0), (x, y, z)
        assert np.linalg.svd(model.tool_pose_and_jacobian(q)[1])[1][-1] > 0.2  # far from singular


def test_centering_leaves_a_limit_that_the_arm_stood_near(model, q_wound_up):
    without, _, _ = along_the_edge(model, q_wound_up, rate=0.0)
    with_it, worst, q = along_the_edge(model, q_wound_up, rate=2.0)
    assert np.min(without[300:]) < np.deg2rad(12.0)
    assert np.min(with_it[300:]) > np.deg2rad(35.0)
    assert np.all(with_it > margin(model, q_wound_up) - 1e-3)  # nothing is paid for it on the way
    assert worst[0] < 2e-4 and worst[1] < 1e-3
    assert np.max(np.abs(q - model.q_nominal)) < 0.3


def test_it_returns_to_the_same_joints_at_the_same_place(model):
    start = joints_for(model, SEVEN_JOINT.q_start, tool_down([0.55, 0.0, 0.55], np.pi))
    margins, worst, q = along_the_edge(model, start, rate=2.0, laps=2)
    np.testing.assert_allclose(q, start, atol=0.02)
    assert np.min(margins) > np.deg2rad(35.0)
    assert worst[0] < 5e-5 and worst[1] < 1e-5


def test_centering_has_no_effect_on_six_joints(arm_model):
    q = joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.0, 0.70], np.pi))
    goal = tool_down([0.57, 0.01, 0.70], 3.0)
    steps = [step_joints(arm_model, make_parameters(arm_model, PERIOD, rate), q, goal)[0] for rate in (0.0, 50.0)]
    np.testing.assert_array_equal(*steps)
