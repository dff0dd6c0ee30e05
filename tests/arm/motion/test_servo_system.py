import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.arm.motion.servo import Servo
from drake_tracker.arm.motion.servo_system import ServoSystem, add_servo
from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    ArmCommand,
    Prediction,
    ServoTarget,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import (
    ESTIMATOR_SLOT,
    SERVO_PERIOD,
    SERVO_SLOT,
    TIME_STEP,
    VISION_PERIOD,
    servo_slot,
    vision_slot,
)

TICK = servo_slot(SERVO_SLOT)
SPEED = 0.2


class Host(LeafSystem):
    """Packets of a straight path along x, a new one each vision cycle until ``until`` [s]."""

    def __init__(self, until=np.inf):
        super().__init__()
        self._until = until
        self.DeclareStateOutputPort("packet", self.DeclareDiscreteState(message_size(Prediction)))
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, vision_slot(ESTIMATOR_SLOT), self._update)

    def _update(self, context, state):
        now = context.get_time()
        if 0.3 < now < self._until:
            stamp = now - 0.25
            times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            one = np.ones_like(times)
            knots = np.column_stack([0.3 + SPEED * times, 0.1 * one, 0.485 * one, 0.0 * one, 0.002 * one])
            state.set_value(0, pack_prediction(stamp, round(now / VISION_PERIOD), knots))


class Blindfold(LeafSystem):
    """An `ArmCommand` of an arm that is blind from ``blind_from`` [s] on."""

    def __init__(self, blind_from):
        super().__init__()
        self._blind_from = blind_from
        self.DeclareVectorOutputPort("command", message_size(ArmCommand), self._calc)

    def _calc(self, context, output):
        output.SetFromVector([0, 0, 1, 1, 0.2, float(context.get_time() >= self._blind_from), 0.08])


def build(until=np.inf, blind_from=np.inf, swapped=False):
    builder = DiagramBuilder()
    parts = [Host(until), ServoSystem(Servo(lead=0.031)), Blindfold(blind_from)]
    for part in reversed(parts) if swapped else parts:
        builder.AddSystem(part)
    host, servo, blindfold = parts
    builder.Connect(host.GetOutputPort("packet"), servo.GetInputPort("packet"))
    builder.Connect(blindfold.GetOutputPort("command"), servo.GetInputPort("command"))
    builder.ExportOutput(servo.GetOutputPort("target"), "target")
    builder.ExportOutput(servo.GetOutputPort("held_packet"), "held_packet")
    return builder.Build()


def targets(diagram, count):
    simulator = Simulator(diagram)
    rows = []
    for k in range(count):
        simulator.AdvanceTo(k * SERVO_PERIOD + TICK + 0.05 * TIME_STEP)
        rows.append(diagram.GetOutputPort("target").Eval(simulator.get_context()).copy())
    return np.array(rows)


def test_it_ticks_every_30_ms_in_its_slot_and_nowhere_else():
    diagram = build()
    simulator = Simulator(diagram)
    for k in range(20, 24):
        before, after = (k * SERVO_PERIOD + TICK + e * TIME_STEP for e in (-0.05, 0.05))
        simulator.AdvanceTo(before)
        earlier = ServoTarget(diagram.GetOutputPort("target").Eval(simulator.get_context())).time
        simulator.AdvanceTo(after)
        later = ServoTarget(diagram.GetOutputPort("target").Eval(simulator.get_context())).time
        assert earlier == pytest.approx((k - 1) * SERVO_PERIOD + TICK + 0.031)
        assert later == pytest.approx(k * SERVO_PERIOD + TICK + 0.031)


def test_the_target_is_where_the_object_is_when_the_set_point_is_due():
    rows = targets(build(), 100)
    valid = rows[rows[:, -1] == 1.0]
    assert len(valid) > 80 and not np.any(rows[: int(0.3 / SERVO_PERIOD), -1])
    np.testing.assert_allclose(valid[:, 1], 0.3 + SPEED * valid[:, 0], atol=1e-9)
    np.testing.assert_allclose(valid[:, 5], SPEED, atol=1e-6)
    assert not np.any(valid[:, -2])
    # the packet read is the newest one of the host: at most a vision cycle and a slot old
    age = valid[:, 0] - 0.031 - valid[:, 9]
    assert np.all(age > 0.25) and np.all(age < 0.25 + VISION_PERIOD + TIME_STEP)


def test_when_the_link_is_silent_the_target_is_stale_and_continues():
    rows = targets(build(until=1.5), 80)
    times = np.arange(80) * SERVO_PERIOD + TICK
    stale = (rows[:, -2] == 1.0) & (times > 0.6)
    np.testing.assert_array_equal(stale, times > 1.5 + 0.2)
    going_on = (times > 0.6) & (rows[:, 0] < 1.5 - 0.25 + 1.5)
    np.testing.assert_allclose(rows[going_on, 1], 0.3 + SPEED * rows[going_on, 0], atol=1e-9)


def test_while_blind_the_held_packet_stays():
    diagram = build(blind_from=1.5)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.5 + SERVO_PERIOD)
    held = Prediction(diagram.GetOutputPort("held_packet").Eval(simulator.get_context()).copy())
    simulator.AdvanceTo(2.0)
    assert Prediction(diagram.GetOutputPort("held_packet").Eval(simulator.get_context())).stamp == held.stamp
    assert 1.5 - 0.25 - 2 * VISION_PERIOD < held.stamp < 1.5 - 0.25


def test_the_order_in_which_systems_are_added_does_not_matter():
    np.testing.assert_array_equal(targets(build(), 60), targets(build(swapped=True), 60))


def test_outputs_are_state_and_a_clone_replays():
    assert not ServoSystem(Servo()).HasAnyDirectFeedthrough()
    diagram = build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    clone = Simulator(diagram, simulator.get_context().Clone())
    ends = []
    for each in (simulator, clone):
        each.AdvanceTo(1.6)
        ends.append(diagram.GetOutputPort("target").Eval(each.get_context()).copy())
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("time_step, period", [(1.0 / 300.0, 0.06), (1.0 / 600.0, 0.005)])
def test_it_is_added_to_a_diagram_with_any_step_and_period(time_step, period):
    builder = DiagramBuilder()
    host, blindfold = builder.AddSystem(Host(np.inf)), builder.AddSystem(Blindfold(np.inf))
    servo = add_servo(
        builder,
        packet=host.GetOutputPort("packet"),
        command=blindfold.GetOutputPort("command"),
        time_step=time_step,
        period=period,
    )
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(2.0 - 1e-6)
    target = ServoTarget(servo.GetOutputPort("target").Eval(servo.GetMyContextFromRoot(simulator.get_context())))
    last = np.floor(2.0 / period + 1e-6) - 1  # of the ticks, each of which is just before the end of its period
    assert target.valid and target.time == pytest.approx((last + 1 + SPLINE_DELAY) * period, abs=1e-9)
