import numpy as np
import pytest
from arm_plants import joint6_at

from drake_tracker.arm.arm_model import tool_down, tool_yaw
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.tool_yaw import FLIP_ANGLE, best_branch, flip_duration, flip_speed, must_flip
from drake_tracker.arm.motion.transform_equation import share_done


def test_pointing_down_joint_6_turns_the_tool_against_the_world_z_axis(arm_model):
    q = joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.1, 0.7], np.pi))
    yaw = tool_yaw(arm_model.tool_pose(q))
    for wanted in (yaw + 1.0, yaw - 2.5):
        turned = q.copy()
        turned[5] = joint6_at(q[5], yaw, wanted)
        reached = tool_yaw(arm_model.tool_pose(turned))
        assert np.cos(reached - wanted) == pytest.approx(1.0, abs=1e-9)


def test_best_branch_brings_joint_6_within_a_quarter_turn_of_zero():
    rng = np.random.default_rng(6)
    for _ in range(300):
        q6, yaw_T, yaw_O = rng.uniform(-4.6, 4.6), rng.uniform(-80.0, 80.0), rng.uniform(-80.0, 80.0)
        branch = best_branch(q6, yaw_T, yaw_O)
        there = joint6_at(q6, yaw_T, yaw_O + np.pi * branch)
        assert isinstance(branch, int)
        assert abs(there) <= np.pi / 2 + 1e-9


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_jaws_flip_past_the_flip_angle_and_end_well_inside_the_range(sign):
    q6 = sign * (FLIP_ANGLE + 1e-6)
    assert must_flip(q6) and not must_flip(sign * (FLIP_ANGLE - 1e-6))
    branch = best_branch(q6, 0.3, 0.3)  # the tool is on branch 0 now
    assert branch == sign
    landed = joint6_at(q6, 0.3, 0.3 + np.pi * branch)
    assert np.sign(landed) == -sign
    assert not must_flip(landed * 1.5)  # far from turning back at once


def test_a_lap_at_full_speed_leaves_margin_for_a_grasp_begun_at_the_flip_angle(arm_model):
    # The sharpest turn asked for, .2 m/s on R = .12 m, for the time without a flip: descent, closing and one period.
    blind = 0.36 + 0.5 + 0.03
    farthest = FLIP_ANGLE + 0.2 / 0.12 * blind
    assert farthest < np.deg2rad(264.0) <= arm_model.position_upper[5] - np.deg2rad(1.9)


@pytest.mark.parametrize("half_turns", [1, -1])
@pytest.mark.parametrize("yaw_rate", [0.0, 0.7, -1.67])
@pytest.mark.parametrize("rated", [None, np.pi])  # joint 6 of the PUMA 560, wrist 3 of the UR5e
def test_a_flip_keeps_the_last_joint_within_its_speed(arm_model, half_turns, yaw_rate, rated):
    rated = rated or arm_model.velocity_limit[5]
    duration = flip_duration(half_turns, yaw_rate, flip_speed(rated))
    times = np.linspace(0.0, duration, 1001)
    share = np.array([share_done(t / duration) for t in times])
    for rate in (0.0, yaw_rate):  # the path may go on turning, or straighten as the flip begins
        yaw = rate * times + half_turns * np.pi * share
        fastest = np.max(np.abs(np.diff(yaw))) / times[1]
        assert fastest < 0.95 * rated + max(-rate * half_turns, 0.0)
    assert duration < (1.3 if rated > 5.0 else 3.7)  # a slow wrist that must also turn with the path takes long


@pytest.mark.parametrize("rated, yaw_rate", [(None, 3.33), (None, -4.0), (np.pi, 1.67)])
def test_on_a_small_circle_a_flip_ends_well_before_the_next_one(arm_model, rated, yaw_rate):
    """A circle of 60 mm at 0.2 m/s turns by 3.33 rad/s: the jaws once turned over for ever, and nothing was grasped."""
    rated = rated or arm_model.velocity_limit[5]
    half_turns = -np.sign(yaw_rate)
    duration = flip_duration(half_turns, yaw_rate, flip_speed(rated))
    assert duration < 0.86 * np.pi / abs(yaw_rate)
    times = np.linspace(0.0, duration, 1001)
    yaw = yaw_rate * times + half_turns * np.pi * np.array([share_done(t / duration) for t in times])
    assert np.max(np.abs(np.diff(yaw))) / times[1] < 0.95 * rated
