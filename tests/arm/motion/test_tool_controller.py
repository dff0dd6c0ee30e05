import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for, limit_acceleration, make_parameters, step_joints
from drake_tracker.arm.motion.tool_controller import DifferentialIkSystem, TransformEquationSystem
from drake_tracker.arm.motion.tool_motion import MotionFrame, ToolMotion
from drake_tracker.arm.motion.tool_yaw import flip_duration
from drake_tracker.core.messages import ArmCommand, ServoTarget, ToolStatus, message_size
from drake_tracker.core.timing import IK_SLOT, SERVO_PERIOD, TIME_STEP, TRANSFORM_SLOT, servo_slot

GOAL = tool_down([0.60, 0.08, 0.70], np.pi + 0.2)
IK_TICK = servo_slot(IK_SLOT)


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
        simulator.AdvanceTo(k * SERVO_PERIOD + IK_TICK - 0.02 * TIME_STEP)
        np.testing.assert_array_equal(port.Eval(simulator.get_context()), q)
        simulator.AdvanceTo(k * SERVO_PERIOD + IK_TICK + 0.02 * TIME_STEP)
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


HOME = np.array([0.56, 0.0, 0.485, np.pi])
HOVER = 0.22
TRANSFORM_TICK = servo_slot(TRANSFORM_SLOT)
RADIUS, RATE = 0.12, 0.2 / 0.12


def object_at(t):
    a = RATE * t
    return np.array([0.56 + RADIUS * np.cos(a), RADIUS * np.sin(a), 0.485, a + np.pi / 2])


class Orders(LeafSystem):
    """Servo target on a circle; an approach (motion 1) from .3 s on, home (motion 0) before."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("target", message_size(ServoTarget), self._calc_target)
        self.DeclareVectorOutputPort("command", message_size(ArmCommand), self._calc_command)

    def _calc_target(self, context, output):
        t = context.get_time()
        x, y, z, yaw = object_at(t)
        rates = [-RATE * y, RATE * (x - 0.56), 0.0, RATE]
        output.SetFromVector([t, x, y, z, yaw, *rates, t, 1, 0, 0, 1])

    def _calc_command(self, context, output):
        going = context.get_time() > 0.3
        frame = MotionFrame.OBJECT if going else MotionFrame.HOME
        output.SetFromVector([1, float(going), 1.0, frame, HOVER, 0, 0.088])


@pytest.fixture(scope="module")
def diagram(arm_model):
    """The transform equation with the inverse kinematics that gives it joint 6, as in the arm's computer."""
    q = joints_for(arm_model, PUMA560.q_start, tool_down(HOME[:3] + [0.0, 0.0, HOVER], HOME[3]))
    builder = DiagramBuilder()
    orders = builder.AddSystem(Orders())
    system = builder.AddSystem(TransformEquationSystem(ToolMotion(HOME, SERVO_PERIOD), arm_model, q))
    ik = builder.AddSystem(DifferentialIkSystem(arm_model, q))
    for port in ("target", "command"):
        builder.Connect(orders.GetOutputPort(port), system.GetInputPort(port))
    builder.Connect(system.GetOutputPort("X_WT_desired"), ik.GetInputPort("X_WT_desired"))
    builder.Connect(ik.GetOutputPort("q_commanded"), system.GetInputPort("q_commanded"))
    for name in ("X_WT_desired", "status"):
        builder.ExportOutput(system.GetOutputPort(name), name)
    builder.ExportOutput(ik.GetOutputPort("q_commanded"), "q_commanded")
    return builder.Build()


def status_at(diagram, simulator, time):
    simulator.AdvanceTo(time)
    return ToolStatus(diagram.GetOutputPort("status").Eval(simulator.get_context()).copy())


def test_before_the_first_tick_the_tool_is_where_the_joints_have_it(diagram):
    context = diagram.CreateDefaultContext()
    desired = diagram.GetOutputPort("X_WT_desired").Eval(context)
    assert desired.IsNearlyEqualTo(tool_down(HOME[:3] + [0.0, 0.0, HOVER], HOME[3]), 1e-5)
    status = ToolStatus(diagram.GetOutputPort("status").Eval(context))
    assert status.fraction == 1.0 and status.flipping == 0.0


def test_the_pose_desired_is_over_the_object_once_the_approach_is_over(diagram):
    simulator = Simulator(diagram)
    status = status_at(diagram, simulator, 1.0)
    assert status.motion == 1.0 and 0.3 < status.fraction < 0.8
    ticks = int(1.6 / SERVO_PERIOD)
    tick = ticks * SERVO_PERIOD + TRANSFORM_TICK
    status = status_at(diagram, simulator, tick + 0.01 * TIME_STEP)
    x, y, z, yaw = object_at(tick)
    desired = diagram.GetOutputPort("X_WT_desired").Eval(simulator.get_context())
    assert status.fraction == 1.0
    assert desired.IsNearlyEqualTo(tool_down([x, y, z + HOVER], yaw + np.pi * status.branch), 1e-9)
    np.testing.assert_allclose([status.x, status.y, status.z], desired.translation(), atol=1e-12)
    assert status.yaw == pytest.approx(yaw + np.pi * status.branch)


def test_it_ticks_in_its_slot_every_30_ms(diagram):
    simulator = Simulator(diagram)
    for k in (12, 20, 21):
        before = status_at(diagram, simulator, k * SERVO_PERIOD + TRANSFORM_TICK - 0.01 * TIME_STEP)
        after = status_at(diagram, simulator, k * SERVO_PERIOD + TRANSFORM_TICK + 0.01 * TIME_STEP)
        later = status_at(diagram, simulator, (k + 1) * SERVO_PERIOD)
        assert after.x != before.x
        np.testing.assert_array_equal(after[:], later[:])


def test_flipping_is_reported_during_a_flip_and_joint_6_stays_in_range(diagram, arm_model):
    simulator = Simulator(diagram)
    said, q6 = [], []
    for k in range(130):
        status = status_at(diagram, simulator, (k + 1) * SERVO_PERIOD)
        said.append((status.flipping, status.branch))
        q6.append(diagram.GetOutputPort("q_commanded").Eval(simulator.get_context())[5])
    said = np.array(said)
    turned = np.flatnonzero(np.diff(said[:, 1])) + 1
    turned = turned[turned > 11]  # the branch chosen for the approach is no flip
    assert len(turned) >= 1 and np.all(said[turned, 0] == 1.0)
    assert np.max(np.abs(q6)) < np.deg2rad(140.0) < arm_model.position_upper[5]

    # It ends when its time is over, between two ticks too.
    end = turned[0] * SERVO_PERIOD + TRANSFORM_TICK + flip_duration(-np.sign(RATE), RATE)
    again = Simulator(diagram)
    assert status_at(diagram, again, end - 0.3 * TIME_STEP).flipping == 1.0
    assert status_at(diagram, again, end + 0.3 * TIME_STEP).flipping == 0.0


def test_outputs_are_state(diagram, arm_model):
    system = TransformEquationSystem(ToolMotion(HOME, SERVO_PERIOD), arm_model, PUMA560.q_start)
    assert not system.HasAnyDirectFeedthrough()
