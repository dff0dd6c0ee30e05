import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY, SetPointSplineSystem
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP

DELAY = SPLINE_DELAY * SERVO_PERIOD


def log_of(set_points, initial, duration=0.6):
    """Times, q, v and a of the spline at every plant step for a trajectory of set-points."""
    builder = DiagramBuilder()
    source = builder.AddSystem(TrajectorySource(set_points))
    spline = builder.AddSystem(SetPointSplineSystem(initial))
    builder.Connect(source.get_output_port(), spline.GetInputPort("set_point"))
    state = LogVectorOutput(spline.GetOutputPort("desired_state"), builder, publish_period=TIME_STEP)
    acceleration = LogVectorOutput(spline.GetOutputPort("desired_acceleration"), builder, publish_period=TIME_STEP)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(duration)
    log = state.FindLog(simulator.get_context())
    n = len(initial)
    return (
        log.sample_times(),
        log.data()[:n].T,
        log.data()[n:].T,
        acceleration.FindLog(simulator.get_context()).data().T,
    )


def constant_speed(start, rate, duration=1.0):
    return PiecewisePolynomial.FirstOrderHold([0.0, duration], np.column_stack([start, start + duration * rate]))


def test_a_motion_with_constant_speed_is_delayed_and_otherwise_unchanged():
    start, rate = np.array([0.3, -1.0]), np.array([0.8, -0.2])
    times, q, v, a = log_of(constant_speed(start, rate), start)
    late = times > 3 * SERVO_PERIOD
    np.testing.assert_allclose(q[late], start + np.outer(times[late] - DELAY, rate), atol=1e-12)
    np.testing.assert_allclose(v[late], np.broadcast_to(rate, v[late].shape), atol=1e-9)
    np.testing.assert_allclose(a[late], 0.0, atol=1e-8)


def test_it_starts_at_rest_at_the_initial_set_point_and_ends_at_rest_on_the_last():
    step = PiecewisePolynomial.ZeroOrderHold([0.0, 0.1, 1.0], np.array([[0.2, 0.5, 0.5]]))
    times, q, v, _ = log_of(step, [0.2])
    np.testing.assert_allclose(q[times < 0.1], 0.2, atol=1e-12)
    np.testing.assert_allclose(v[times < 0.1], 0.0, atol=1e-12)
    np.testing.assert_allclose(q[times > 0.22], 0.5, atol=1e-12)
    assert np.all(np.diff(q[:, 0]) >= -1e-12) and q.max() <= 0.5 + 1e-12  # no overshoot


def test_position_and_velocity_have_no_steps_and_velocity_is_the_derivative():
    wave = PiecewisePolynomial.CubicShapePreserving(
        np.linspace(0.0, 1.0, 41), np.sin(6.0 * np.linspace(0.0, 1.0, 41))[None, :], True
    )
    times, q, v, a = log_of(wave, [0.0])
    going = times > 4 * SERVO_PERIOD
    assert np.max(np.abs(np.diff(v[going, 0]))) < 45.0 * TIME_STEP  # |acceleration| is about 36 at most
    moved = np.diff(q[:, 0])
    np.testing.assert_allclose(moved, 0.5 * (v[1:, 0] + v[:-1, 0]) * TIME_STEP, atol=1e-3 * TIME_STEP)
    inside = np.abs((times / SERVO_PERIOD + 0.5) % 1.0 - 0.5) > 0.15  # away from the joints of the spline
    steps = inside[1:] & inside[:-1]
    np.testing.assert_allclose(np.diff(v[:, 0])[steps], a[1:, 0][steps] * TIME_STEP, atol=1e-6)


def test_the_plant_reads_the_new_spline_at_the_instant_at_which_it_begins():
    """The plant is a discrete System at its own rate: the two times differ by a rounding, or do not."""

    class Plant(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("acceleration", 1)
            self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(TIME_STEP, 0.0, self._update)
            self.rows = []

        def _update(self, context, state):
            self.rows.append((context.get_time(), self.get_input_port().Eval(context)[0]))

    times = np.arange(0.0, 6.0, SERVO_PERIOD)
    set_points = np.where(np.arange(len(times)) % 2, 0.01, 0.0)[None, :]
    builder = DiagramBuilder()
    steps = PiecewisePolynomial.ZeroOrderHold(times - 0.5 * SERVO_PERIOD, set_points)
    source = builder.AddSystem(TrajectorySource(steps))
    spline, plant = builder.AddSystem(SetPointSplineSystem([0.0])), builder.AddSystem(Plant())
    builder.Connect(source.get_output_port(), spline.GetInputPort("set_point"))
    builder.Connect(spline.GetOutputPort("desired_acceleration"), plant.get_input_port())
    Simulator(builder.Build()).AdvanceTo(5.5)
    rows = np.array(plant.rows)
    periods = np.floor(rows[:, 0] / SERVO_PERIOD + 0.01).astype(int)
    for period in range(5, 180):  # one acceleration throughout a period
        assert np.ptp(rows[periods == period, 1]) < 1e-9


def test_outputs_are_state_and_hold_when_asked_late():
    spline = SetPointSplineSystem([0.1, 0.2])
    set_point = spline.GetInputPort("set_point").get_index()
    assert not any(spline.HasDirectFeedthrough(set_point, k) for k in range(spline.num_output_ports()))
    context = spline.CreateDefaultContext()
    context.SetTime(5.0)  # no sample came: the reference does not run away
    np.testing.assert_allclose(spline.GetOutputPort("desired_state").Eval(context), [0.1, 0.2, 0.0, 0.0], atol=1e-15)
    assert spline.GetOutputPort("desired_state").size() == 4
    assert pytest.approx(0.045) == DELAY
