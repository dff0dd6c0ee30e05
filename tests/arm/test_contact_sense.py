import numpy as np
import pytest

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560_CUP, SEVEN_JOINT
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.grasp.ball.touch_machine import contact_force, low_pass


@pytest.mark.parametrize("description", [PUMA560_CUP, SEVEN_JOINT], ids=["six joints", "seven joints"])
def test_a_force_on_the_tool_is_found_whatever_the_motion(description):
    model = make_arm_model(description)
    q = joints_for(model, description.q_start, tool_down([0.55, 0.1, 0.56], np.pi))
    rng = np.random.default_rng(2)
    for force in ([0.0, 0.0, 3.0], [1.0, -2.0, 10.0], [0.0, 0.0, 0.0]):
        v, a = rng.uniform(-0.3, 0.3, (2, model.num_joints))
        _, J_WT = model.tool_pose_and_jacobian(q)
        effort = model.drive_torques(q, v, a) - J_WT[3:].T @ np.array(force)
        np.testing.assert_allclose(contact_force(model, q, v, a, effort), force, atol=1e-9)


def test_torques_of_free_motion_are_gravity_friction_and_inertia(arm_model):
    q, v, a = np.array([0.2, 0.8, -2.6, 0.1, -1.2, 0.3]), np.full(6, 0.2), np.full(6, 0.5)
    plant = arm_model.plant
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    rest = arm_model.drive_torques(q, 0 * v, 0 * a)
    np.testing.assert_allclose(rest, -plant.CalcGravityGeneralizedForces(context), atol=1e-9)
    np.testing.assert_allclose(
        arm_model.drive_torques(q, 0 * v, a) - rest, plant.CalcMassMatrix(context) @ a, atol=1e-9
    )
    damping = np.array([plant.GetJointByName(f"joint{i}").default_damping() for i in range(1, 7)])
    plant.SetVelocities(context, v)
    np.testing.assert_allclose(
        arm_model.drive_torques(q, v, 0 * a) - rest, damping * v + plant.CalcBiasTerm(context), atol=1e-9
    )


def test_a_low_pass_reaches_63_percent_after_its_time_constant():
    value = 0.0
    for _ in range(10):
        value = low_pass(value, 1.0, 0.005, 0.05)
    assert value == pytest.approx(1.0 - np.exp(-1.0))
