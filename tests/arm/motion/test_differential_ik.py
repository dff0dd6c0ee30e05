import numpy as np
import pytest
from pydrake.math import RollPitchYaw, RotationMatrix

from drake_tracker.arm.arm_model import tool_down, tool_yaw
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import (
    LIMIT_MARGIN,
    SPEED_SHARE,
    joints_for,
    make_parameters,
    rehearse,
    rotation_vector,
    step_joints,
)
from drake_tracker.arm.motion.transform_equation import share_done
from drake_tracker.core.timing import SERVO_PERIOD

HOVER = np.array([0.56, 0.0, 0.705])


@pytest.fixture(scope="module")
def parameters(arm_model):
    return make_parameters(arm_model, SERVO_PERIOD)


@pytest.fixture(scope="module")
def q_hover(arm_model):
    return joints_for(arm_model, PUMA560.q_start, tool_down(HOVER, np.pi))


def oval(t, height=0.705, speed=0.2):
    a = speed / np.hypot(0.16, 0.22) * np.sqrt(2.0) * t
    heading = np.arctan2(0.22 * np.cos(a), -0.16 * np.sin(a))
    return tool_down([0.56 + 0.16 * np.cos(a), 0.22 * np.sin(a), height], heading)


def within_limits(model, q, q_next):
    speed = np.abs(q_next - q) / SERVO_PERIOD
    assert np.all(speed <= SPEED_SHARE * model.velocity_limit * (1 + 1e-6))
    assert np.all(q_next >= model.position_lower + LIMIT_MARGIN - 1e-6)
    assert np.all(q_next <= model.position_upper - LIMIT_MARGIN + 1e-6)


def test_follows_an_oval_from_set_point_to_set_point(arm_model, parameters):
    q = joints_for(arm_model, PUMA560.q_start, oval(0.0))
    worst = 0.0
    for k in range(1, 120):  # till joint 6 nears its end: turning the jaws over is not for this module
        X_WT_desired = oval(k * SERVO_PERIOD)
        q, ok = step_joints(arm_model, parameters, q, X_WT_desired)
        assert ok
        X_WT = arm_model.tool_pose(q)
        worst = max(worst, np.linalg.norm(X_WT.translation() - X_WT_desired.translation()))
        assert np.linalg.norm(rotation_vector(X_WT_desired.rotation() @ X_WT.rotation().inverse())) < 1e-3
    assert worst < 2e-4


def test_a_far_pose_is_approached_at_limited_speed_and_in_its_direction(arm_model, parameters, q_hover):
    goal = tool_down(HOVER + [0.1, 0.2, 0.05], np.pi + 0.5)
    q, slowed = q_hover, 0
    start = arm_model.tool_pose(q).translation()
    line = (goal.translation() - start) / np.linalg.norm(goal.translation() - start)
    for _ in range(60):
        q_next, ok = step_joints(arm_model, parameters, q, goal)
        within_limits(arm_model, q, q_next)
        slowed += not ok
        q = q_next
        gone = arm_model.tool_pose(q).translation() - start
        assert np.linalg.norm(gone - line * (gone @ line)) < 0.01
    assert slowed >= 3
    assert arm_model.tool_pose(q).IsNearlyEqualTo(goal, 1e-5) and ok


def test_limits_hold_for_any_pose(arm_model, parameters, q_hover):
    rng = np.random.default_rng(3)
    q = q_hover
    for _ in range(60):
        goal = tool_down(rng.uniform([-1.0, -1.0, 0.0], [1.0, 1.0, 1.5]), rng.uniform(-6.0, 6.0))
        for _ in range(5):
            q_next, _ = step_joints(arm_model, parameters, q, goal)
            assert np.all(np.isfinite(q_next))
            within_limits(arm_model, q, q_next)
            q = q_next


def test_joint_6_stops_before_its_limit_and_reports_it(arm_model, parameters, q_hover):
    q, yaw, ok = q_hover, np.pi, True
    for _ in range(150):
        yaw -= 0.08  # raises joint 6
        q_next, ok = step_joints(arm_model, parameters, q, tool_down(HOVER, yaw))
        within_limits(arm_model, q, q_next)
        q = q_next
    assert not ok
    assert np.max(q[5]) > np.deg2rad(180.0)


def test_out_of_reach_it_stays_finite_and_recovers(arm_model, parameters, q_hover):
    q, far = q_hover, tool_down([2.0, 0.5, 0.7], np.pi)
    for _ in range(120):
        q_next, ok = step_joints(arm_model, parameters, q, far)
        assert np.all(np.isfinite(q_next))
        within_limits(arm_model, q, q_next)
        step, q = np.linalg.norm(q_next - q), q_next
    assert not ok
    assert step < 1e-3  # it stands
    for _ in range(200):
        q, ok = step_joints(arm_model, parameters, q, tool_down(HOVER, np.pi))
    assert ok and arm_model.tool_pose(q).IsNearlyEqualTo(tool_down(HOVER, np.pi), 1e-5)


def test_it_changes_neither_the_set_point_given_nor_itself(arm_model, parameters, q_hover):
    before = q_hover.copy()
    first, _ = step_joints(arm_model, parameters, q_hover, tool_down(HOVER + [0.01, 0.0, 0.0], 3.0))
    second, _ = step_joints(arm_model, parameters, q_hover, tool_down(HOVER + [0.01, 0.0, 0.0], 3.0))
    np.testing.assert_array_equal(q_hover, before)
    np.testing.assert_array_equal(first, second)


def descent(duration, speed, from_height=0.22):
    """Poses over an object that moves at ``speed`` [m/s] along y while the hand comes down on it."""
    for k in range(1, int(np.ceil(duration / SERVO_PERIOD)) + 1):
        t = k * SERVO_PERIOD
        yield tool_down([0.56, speed * t, 0.485 + from_height * (1.0 - share_done(t / duration))], np.pi)


def test_rehearsal_agrees_to_the_default_descent(arm_model, parameters, q_hover):
    assert rehearse(arm_model, parameters, q_hover, list(descent(0.36, 0.2)), 0.004)


@pytest.mark.parametrize("poses", [descent(0.12, 0.2), descent(0.36, 3.0)], ids=["too fast down", "too fast away"])
def test_rehearsal_refuses_a_descent_that_the_arm_cannot_make(arm_model, parameters, q_hover, poses):
    assert not rehearse(arm_model, parameters, q_hover, list(poses), 0.004)


def test_rehearsal_refuses_what_is_out_of_reach_and_tolerance_decides(arm_model, parameters, q_hover):
    poses = [tool_down(HOVER + [0.05, 0.0, 0.0], np.pi)]
    assert not rehearse(arm_model, parameters, q_hover, poses, 0.004)
    assert rehearse(arm_model, parameters, q_hover, poses, 0.06)
    assert rehearse(arm_model, parameters, q_hover, [], 0.004)


def test_rotation_vector_is_axis_times_angle():
    for vector in ([0.0, 0.0, 0.7], [0.3, -0.4, 0.5], [0.0, -1e-7, 0.0]):
        angle = np.linalg.norm(vector)
        K = np.cross(np.eye(3), np.divide(vector, angle))  # K v = axis x v
        R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
        np.testing.assert_allclose(rotation_vector(RotationMatrix(R)), vector, atol=1e-9)
    np.testing.assert_allclose(rotation_vector(RollPitchYaw(0.0, 0.2, 0.0).ToRotationMatrix()), [0.0, 0.2, 0.0])


def test_yaw_is_followed_with_the_position(arm_model, parameters, q_hover):
    q = q_hover
    for _ in range(5):
        q, ok = step_joints(arm_model, parameters, q, tool_down(HOVER, np.pi - 0.1))
    assert ok and tool_yaw(arm_model.tool_pose(q)) == pytest.approx(np.pi - 0.1, abs=1e-6)
