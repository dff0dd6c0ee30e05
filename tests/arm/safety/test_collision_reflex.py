import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.motion.set_point_spline_system import SetPointSplineSystem
from drake_tracker.arm.safety.collision_reflex import COAST, HOLD, PATIENCE, CollisionReflex
from drake_tracker.arm.safety.collision_reflex_system import CollisionReflexSystem
from drake_tracker.arm.safety.joint_limiter import JointLimiter, Limit
from drake_tracker.arm.safety.joint_limiter_system import JointLimiterSystem
from drake_tracker.core.messages import LimiterReport
from drake_tracker.core.timing import REFLEX_SLOT, SERVO_PERIOD, TIME_STEP

SAMPLES = round(PATIENCE / TIME_STEP)
Q = np.array([0.1, 0.9, -2.7, 0.0, -1.2, 0.2])
STILL = np.zeros(6)


@pytest.fixture(scope="module")
def reflex(arm_model):
    return CollisionReflex(arm_model)


def after(reflex, efforts, v=STILL, acceleration=STILL):
    """Returns the states after samples with these efforts, one each plant step; the joints accelerate steadily."""
    states = [reflex.initial_state()]
    for k, effort in enumerate(efforts):
        now = k * TIME_STEP
        states.append(reflex.update(states[-1], now, Q, v + now * acceleration, np.asarray(effort)))
    return states[1:]


def full(arm_model, joint, sign=1.0):
    return sign * arm_model.effort_limit * np.eye(6)[joint]


@pytest.mark.parametrize("joint, sign", [(0, 1.0), (2, -1.0), (5, 1.0)])
def test_a_drive_that_pushes_with_all_its_torque_for_too_long_gives_way(arm_model, reflex, joint, sign):
    states = after(reflex, [full(arm_model, joint, sign)] * (SAMPLES + 1))
    assert [state.held for state in states] == [False] * (SAMPLES - 1) + [True] * 2
    np.testing.assert_array_equal(states[-1].q_hold, Q)


def test_a_joint_that_still_moves_coasts_on_within_its_range(arm_model, reflex):
    v = np.array([1.5, 0.0, 0.0, 0.0, -3.0, 300.0])
    state = after(reflex, [full(arm_model, 1)] * SAMPLES, v)[-1]
    np.testing.assert_allclose(state.q_hold[:5], (Q + COAST * v)[:5])
    assert state.q_hold[5] == arm_model.position_upper[5]


def test_a_drive_whose_torque_moves_the_arm_does_not_give_way(arm_model, reflex):
    """All the torque of joint 1 goes into the acceleration that it causes: nothing is in the way."""
    free = full(arm_model, 0)
    steady = arm_model.drive_torques(Q, STILL, STILL)
    columns = np.array([arm_model.drive_torques(Q, STILL, axis) - steady for axis in np.eye(6)]).T
    acceleration = np.linalg.solve(columns, free - steady)
    v = -0.03 * acceleration  # a reversal, so that the joint is slow on average
    assert not any(state.held for state in after(reflex, [free] * 15, v, acceleration))
    assert any(state.held for state in after(reflex, [free] * 15, v, 0.3 * acceleration))


def test_short_saturations_of_different_drives_do_not_add_up(arm_model, reflex):
    efforts = [full(arm_model, k // (SAMPLES - 1) % 6) for k in range(40)]
    assert not any(state.held for state in after(reflex, efforts))
    almost = [0.99 * full(arm_model, 0)] * 100
    assert not any(state.held for state in after(reflex, almost))


def test_the_joints_are_free_again_after_a_while(arm_model, reflex):
    efforts = [full(arm_model, 0)] * SAMPLES + [STILL] * 60
    held = TIME_STEP * sum(state.held for state in after(reflex, efforts))
    assert held == pytest.approx(HOLD, abs=2 * TIME_STEP)


def test_every_follower_rests_at_the_hold_and_goes_on_from_there(arm_model):
    """The spline stops at once, the limiter with its next set-point, and both begin again where the joints are."""
    builder = DiagramBuilder()
    reflex = builder.AddSystem(CollisionReflexSystem(arm_model))
    limiter = builder.AddSystem(JointLimiterSystem(JointLimiter(arm_model), Q))
    spline = builder.AddSystem(SetPointSplineSystem(Q))
    builder.Connect(reflex.GetOutputPort("hold"), limiter.GetInputPort("hold"))
    builder.Connect(reflex.GetOutputPort("hold"), spline.GetInputPort("hold"))
    builder.Connect(limiter.GetOutputPort("q_commanded"), spline.GetInputPort("set_point"))
    simulator = Simulator(builder.Build())
    context = simulator.get_context()
    inputs = reflex.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    wanted = Q + [0.03, 0.0, 0.0, 0.0, 0.0, 0.0]
    limiter.GetInputPort("q_wanted").FixValue(limiter.GetMyContextFromRoot(context), wanted)
    where = Q + [0.01, 0.0, 0.0, 0.0, 0.0, 0.0]
    reflex.GetInputPort("arm_state").FixValue(inputs, np.append(where, STILL))
    effort = reflex.GetInputPort("arm_effort")
    effort.FixValue(inputs, STILL)

    def read(system, port):
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(context)).copy()

    simulator.AdvanceTo(0.3)
    np.testing.assert_allclose(read(spline, "desired_state"), np.append(wanted, STILL), atol=1e-9)
    effort.FixValue(inputs, full(arm_model, 0))
    simulator.AdvanceTo(0.3 + SAMPLES * TIME_STEP - 0.5 * (1 - REFLEX_SLOT) * TIME_STEP)
    assert read(reflex, "hold")[0] == 1.0
    np.testing.assert_array_equal(read(spline, "desired_state"), np.append(where, STILL))
    np.testing.assert_array_equal(read(spline, "desired_acceleration"), STILL)
    effort.FixValue(inputs, STILL)
    simulator.AdvanceTo(0.3 + SERVO_PERIOD)
    np.testing.assert_array_equal(read(limiter, "q_commanded"), where)
    report = LimiterReport(read(limiter, "limiter_report"))
    assert report.contact == 1 and len(report[:]) == 1 + len(Limit)
    speeds = []
    for k in range(100):
        simulator.AdvanceTo(0.3 + SERVO_PERIOD + k * TIME_STEP)
        speeds.append(read(spline, "desired_state")[6])
    assert max(speeds) < arm_model.velocity_limit[0]
    np.testing.assert_allclose(read(spline, "desired_state"), np.append(wanted, STILL), atol=1e-9)


def test_without_the_torques_there_is_no_reflex(arm_model):
    system = CollisionReflexSystem(arm_model)
    simulator = Simulator(system)
    simulator.AdvanceTo(0.05)
    assert not system.GetOutputPort("hold").Eval(simulator.get_context()).any()


def test_a_hand_that_is_sent_onto_a_block_does_not_press_on_with_full_torque(arm_model):
    """Closed loop with contact: the hand goes down onto a block that nobody told the arm about."""
    from arm_on_block import press

    with_reflex, without = press(reflex=True), press(reflex=False)
    assert without > 0.1
    assert with_reflex <= 0.030
