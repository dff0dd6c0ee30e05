import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from drake_tracker.arm.arm_model import tool_down, tool_yaw
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import rotation_vector
from drake_tracker.arm.plant import add_arm

RNG = np.random.default_rng(560)


def random_joints(model, count):
    return RNG.uniform(model.position_lower, model.position_upper, size=(count, model.num_joints))


@pytest.mark.parametrize("yaw", [-3.0, -1.0, 0.0, 2.0, np.pi])
def test_tool_yaw_is_the_inverse_of_tool_down(yaw):
    X_WT = tool_down([0.5, 0.1, 0.6], yaw)
    assert tool_yaw(X_WT) == pytest.approx(yaw)
    np.testing.assert_array_equal(X_WT.translation(), [0.5, 0.1, 0.6])
    np.testing.assert_allclose(X_WT.rotation().matrix()[:, 2], [0.0, 0.0, -1.0])


def test_the_tool_is_where_the_whole_robot_with_moving_fingers_has_it(arm_model):
    plant = MultibodyPlant(0.0)
    parts = add_arm(plant, description=PUMA560)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    tool = plant.GetFrameByName(PUMA560.tool_frame, parts.gripper)
    for q in random_joints(arm_model, 10):
        plant.SetPositions(context, parts.arm, q)
        assert arm_model.tool_pose(q).IsNearlyEqualTo(tool.CalcPoseInWorld(context), 1e-12)


def test_jacobian_is_the_derivative_of_the_pose(arm_model):
    h = 1e-6
    for q in random_joints(arm_model, 5):
        X_WT, J_WT = arm_model.tool_pose_and_jacobian(q)
        assert J_WT.shape == (6, 6)
        assert X_WT.IsExactlyEqualTo(arm_model.tool_pose(q))
        for joint in range(6):
            step = np.zeros(6)
            step[joint] = h
            ahead, behind = arm_model.tool_pose(q + step), arm_model.tool_pose(q - step)
            linear = (ahead.translation() - behind.translation()) / (2 * h)
            angular = rotation_vector(ahead.rotation() @ behind.rotation().inverse()) / (2 * h)
            np.testing.assert_allclose(J_WT[:, joint], [*angular, *linear], atol=1e-6)


def test_limits_are_the_arms_own(arm_model):
    assert arm_model.num_joints == 6
    np.testing.assert_allclose(np.rad2deg(arm_model.position_lower), [-160, -45, -225, -110, -100, -266])
    np.testing.assert_allclose(np.rad2deg(arm_model.position_upper), [160, 225, 45, 170, 100, 266])
    np.testing.assert_allclose(arm_model.velocity_limit, [1.92, 1.51, 2.40, 5.34, 5.09, 5.74])


def test_results_do_not_depend_on_earlier_calls(arm_model):
    first, second = random_joints(arm_model, 2)
    before = arm_model.tool_pose(first)
    arm_model.tool_pose_and_jacobian(second)
    assert arm_model.tool_pose(first).IsExactlyEqualTo(before)
