import numpy as np
import pytest
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for, make_parameters, step_joints
from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY, add_joint_feedforward, add_set_point_spline
from drake_tracker.arm.plant import actuators_of, add_arm, couple_fingers, set_servo_gains
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP

SPEED = 0.2


def oval(t):
    a = SPEED / np.hypot(0.16, 0.22) * np.sqrt(2.0) * t
    return np.array([0.56 + 0.16 * np.cos(a), 0.22 * np.sin(a), 0.705])


class SetPoints(LeafSystem):
    """Joint set-points from a table, one each servo period; the last one stays."""

    def __init__(self, rows):
        super().__init__()
        self._rows = np.array(rows)
        self.DeclareVectorOutputPort("q", self._rows.shape[1], self._calc)

    def _calc(self, context, output):
        k = min(round(context.get_time() / SERVO_PERIOD + 1e-6), len(self._rows) - 1)
        output.SetFromVector(self._rows[k])


class Bench:
    """The arm alone with its joint servos, its set-points from a table."""

    def __init__(self, model, rows):
        builder = DiagramBuilder()
        plant = MultibodyPlant(TIME_STEP)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
        self.parts = add_arm(plant, description=PUMA560)
        couple_fingers(plant, self.parts.gripper, PUMA560)
        set_servo_gains(plant, self.parts.arm, PUMA560.servo_inertia, PUMA560.servo_bandwidth)
        plant.Finalize()
        plant.SetDefaultPositions(self.parts.arm, rows[0])
        plant.SetDefaultPositions(self.parts.gripper, [0.0225, 0.0225])
        self.plant = builder.AddSystem(plant)
        points = builder.AddSystem(SetPoints(rows))
        spline = add_set_point_spline(
            builder, name="joint_spline", set_points=points.get_output_port(), initial=rows[0]
        )
        dynamics = add_joint_feedforward(
            builder, model=model, desired_acceleration=spline.GetOutputPort("desired_acceleration")
        )
        arm = self.parts.arm
        builder.Connect(plant.get_state_output_port(arm), dynamics.get_input_port_estimated_state())
        builder.Connect(dynamics.get_output_port_generalized_force(), plant.get_actuation_input_port(arm))
        builder.Connect(spline.GetOutputPort("desired_state"), plant.get_desired_state_input_port(arm))
        self.state_log = LogVectorOutput(plant.get_state_output_port(arm), builder, publish_period=TIME_STEP)
        self.effort_log = LogVectorOutput(plant.get_net_actuation_output_port(arm), builder, publish_period=TIME_STEP)
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        plant.get_desired_state_input_port(self.parts.gripper).FixValue(
            plant.GetMyContextFromRoot(self.context), [0.0225, 0.0]
        )

    def run(self, duration):
        """Returns times, q, v and drive torques at each plant step."""
        Simulator(self.diagram, self.context).AdvanceTo(duration)
        log = self.state_log.FindLog(self.context)
        state = log.data().T
        return log.sample_times(), state[:, :6], state[:, 6:], self.effort_log.FindLog(self.context).data().T


@pytest.fixture(scope="module")
def q_hover(arm_model):
    return joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.0, 0.705], np.pi))


def test_gains_are_those_of_a_critically_damped_joint():
    plant = MultibodyPlant(TIME_STEP)
    parts = add_arm(plant, description=PUMA560)
    inertia, bandwidth = np.arange(1.0, 7.0), np.arange(10.0, 70.0, 10.0)
    set_servo_gains(plant, parts.arm, inertia, bandwidth)
    gains = [actuator.get_controller_gains() for actuator in actuators_of(plant, parts.arm)]
    np.testing.assert_allclose([gain.p for gain in gains], inertia * bandwidth**2)
    np.testing.assert_allclose([gain.d for gain in gains], 2 * inertia * bandwidth)
    with pytest.raises(ValueError):
        set_servo_gains(plant, parts.arm, inertia[:5], bandwidth)


def test_actuators_are_those_of_the_instance_in_order():
    plant = MultibodyPlant(TIME_STEP)
    parts = add_arm(plant, description=PUMA560)
    assert [actuator.name() for actuator in actuators_of(plant, parts.arm)] == [f"joint{i}" for i in range(1, 7)]
    assert len(actuators_of(plant, parts.gripper)) == 1


def test_the_arm_stands_still_under_gravity(arm_model, q_hover):
    bench = Bench(arm_model, [q_hover])
    _, q, v, effort = bench.run(0.6)
    np.testing.assert_allclose(q, np.broadcast_to(q_hover, q.shape), atol=2e-5)
    assert np.max(np.abs(v)) < 1e-3
    assert np.abs(effort[-1, 1]) > 5.0  # which takes a torque


def test_the_tool_follows_an_oval_of_set_points_and_the_drives_have_torque_left(arm_model):
    start = tool_down(oval(0.0), np.pi)
    rows = [joints_for(arm_model, PUMA560.q_start, start)]
    parameters = make_parameters(arm_model, SERVO_PERIOD)
    for k in range(1, 110):
        q, ok = step_joints(arm_model, parameters, rows[-1], tool_down(oval(k * SERVO_PERIOD), np.pi))
        assert ok
        rows.append(q)
    bench = Bench(arm_model, rows)
    times, q, v, effort = bench.run(3.2)
    settled = np.flatnonzero(times > 0.6)[::5]
    tool = np.array([arm_model.tool_pose(q[i]).translation() for i in settled])

    def rms(delay):
        error = tool - np.array([oval(t - delay) for t in times[settled]])
        return np.sqrt(np.mean(np.sum(error**2, axis=1)))

    # A set-point is sampled at its time and passed SPLINE_DELAY periods later.
    assert rms(SPLINE_DELAY * SERVO_PERIOD) < 1.0e-3
    assert rms(0.0) > 7e-3  # the delay is real: 9 mm at .2 m/s
    limits = [actuator.effort_limit() for actuator in actuators_of(bench.plant, bench.parts.arm)]
    assert np.all(np.max(np.abs(effort[settled]), axis=0) < 0.7 * np.array(limits))
    assert np.all(np.max(np.abs(v[settled]), axis=0) < arm_model.velocity_limit)
