import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for, limit_acceleration, make_parameters, step_joints
from drake_tracker.arm.motion.differential_ik_system import DifferentialIkSystem
from drake_tracker.core.timing import IK_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot

GOAL = tool_down([0.60, 0.08, 0.70], np.pi + 0.2)
TICK = servo_slot(IK_SLOT)


@pytest.fixture(scope="module")
def q_initial(arm_model):
    return joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.0, 0.705], np.pi))


def start(arm_model, q_initial, goal=GOAL):
    system = DifferentialIkSystem(arm_model, q_initial)
    context = system.CreateDefaultContext()
    system.GetInputPort("X_WT_desired").FixValue(context, AbstractValue.Make(goal))
    return system, Simulator(system, context)


def test_it_takes_one_step_each_period_in_its_slot(arm_model, q_initial):
    system, simulator = start(arm_model, q_initial)
    port, parameters, q = system.GetOutputPort("q_commanded"), make_parameters(arm_model, SERVO_PERIOD), q_initial
    v = np.zeros_like(q)
    for k in range(8):
        simulator.AdvanceTo(k * SERVO_PERIOD + TICK - 0.02 * TIME_STEP)
        np.testing.assert_array_equal(port.Eval(simulator.get_context()), q)
        simulator.AdvanceTo(k * SERVO_PERIOD + TICK + 0.02 * TIME_STEP)
        wanted, _ = step_joints(arm_model, parameters, q, GOAL)
        q, v = limit_acceleration(arm_model, parameters, q, v, wanted)
        np.testing.assert_array_equal(port.Eval(simulator.get_context()), q)


def test_no_change_of_speed_asks_for_more_than_the_drives_have(arm_model, q_initial):
    parameters = make_parameters(arm_model, SERVO_PERIOD)
    q, v = q_initial, np.zeros_like(q_initial)
    turned = RigidTransform(RotationMatrix.MakeZRotation(2.5) @ GOAL.rotation(), GOAL.translation())
    asked = []
    for k in range(40):  # back and forth, as a hand would that follows a bad estimate
        wanted, _ = step_joints(arm_model, parameters, q, turned if k // 8 % 2 else GOAL)
        before = v
        q, v = limit_acceleration(arm_model, parameters, q, v, wanted)
        asked.append(arm_model.inertia(q) * np.abs(v - before) / SERVO_PERIOD / arm_model.effort_limit)
    assert 0.8 < np.max(asked) < 0.9
    assert np.all(q > arm_model.position_lower) and np.all(q < arm_model.position_upper)


def test_it_arrives_and_stays(arm_model, q_initial):
    system, simulator = start(arm_model, q_initial)
    simulator.AdvanceTo(2.0)
    q = system.GetOutputPort("q_commanded").Eval(simulator.get_context()).copy()
    assert arm_model.tool_pose(q).IsNearlyEqualTo(GOAL, 1e-5)
    simulator.AdvanceTo(2.5)
    np.testing.assert_allclose(system.GetOutputPort("q_commanded").Eval(simulator.get_context()), q, atol=1e-5)


def test_a_pose_out_of_reach_leaves_finite_set_points_within_the_limits(arm_model, q_initial):
    system, simulator = start(arm_model, q_initial, RigidTransform(GOAL.rotation(), [3.0, 0.0, 1.0]))
    simulator.AdvanceTo(3.0)
    q = system.GetOutputPort("q_commanded").Eval(simulator.get_context())
    assert np.all(np.isfinite(q)) and np.all(q > arm_model.position_lower) and np.all(q < arm_model.position_upper)


def test_it_starts_at_the_given_set_point_and_does_not_feed_through(arm_model, q_initial):
    system = DifferentialIkSystem(arm_model, q_initial)
    assert not system.HasAnyDirectFeedthrough()
    np.testing.assert_array_equal(system.GetOutputPort("q_commanded").Eval(system.CreateDefaultContext()), q_initial)
    ports = [system.get_input_port(index).get_name() for index in range(system.num_input_ports())]
    assert ports == ["X_WT_desired", "q_last"]  # the measured joints are not read
