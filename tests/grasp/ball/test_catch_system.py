import numpy as np
import pytest
from catches import PERIOD, TIME_STEP, ball_packet, edge
from pydrake.systems.analysis import Simulator

from drake_tracker.core.messages import ArmCommand, CatchDiagnosis, Prediction, ServoTarget, ToolStatus, message_size
from drake_tracker.core.timing import GRASP_SLOT, servo_slot
from drake_tracker.grasp.ball.catch_machine import CatchMachine
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.ball.catch_system import CatchSystem
from drake_tracker.grasp.config import CatchConfig

TICK = servo_slot(GRASP_SLOT, TIME_STEP, PERIOD)


@pytest.fixture
def system():
    return CatchSystem(CatchMachine(CatchConfig(), edge(), PERIOD), TIME_STEP, PERIOD)


def with_inputs(system, packet, operator=None):
    """A simulator of the System alone: the hand at home, the ball's packet as given."""
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    home = edge().home + [0.0, 0.0, CatchConfig().rim_height, 0.0]
    system.GetInputPort("target").FixValue(context, np.append(np.zeros(13), Prediction(packet).valid))
    system.GetInputPort("packet").FixValue(context, packet)
    system.GetInputPort("status").FixValue(context, [0.0, 1.0, 0.0, *home, 0.0])
    if operator is not None:
        system.GetInputPort("operator").FixValue(context, operator)
    return simulator


def outputs(system, context):
    names = ("command", "object", "diagnosis", "ready")
    return {name: system.GetOutputPort(name).Eval(context).copy() for name in names}


def test_before_the_first_tick_it_commands_to_wait_at_home(system):
    found = outputs(system, system.CreateDefaultContext())
    assert ArmCommand(found["command"]).phase == CatchPhase.WAIT
    np.testing.assert_array_equal(found["object"][1:5], edge().home)
    assert found["ready"] == [0.0] and not np.any(found["diagnosis"])
    assert len(found["object"]) == message_size(ServoTarget) and message_size(ToolStatus) == 8


def test_it_waits_follows_and_reports_what_it_sees(system):
    simulator = with_inputs(system, ball_packet(0.0, 1.0, 0.1))
    simulator.AdvanceTo(0.2)
    diagnosis = CatchDiagnosis(outputs(system, simulator.get_context())["diagnosis"])
    assert (diagnosis.phase, diagnosis.known) == (CatchPhase.FOLLOW, 1.0)
    assert diagnosis.time_left == pytest.approx(0.8, abs=PERIOD + 0.001)
    np.testing.assert_allclose([diagnosis.x, diagnosis.y], edge().place(0.1)[:2], atol=1e-3)
    assert diagnosis.std == pytest.approx(0.004)


def test_it_is_ready_without_a_ball(system):
    simulator = with_inputs(system, np.zeros(message_size(Prediction)))
    simulator.AdvanceTo(0.2)
    assert outputs(system, simulator.get_context())["ready"] == [0.0]
    simulator.AdvanceTo(0.4)
    assert outputs(system, simulator.get_context())["ready"] == [1.0]


def test_the_operator_port_is_read_and_may_be_unconnected(system):
    simulator = with_inputs(system, np.zeros(message_size(Prediction)), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    simulator.AdvanceTo(0.05)
    assert outputs(system, simulator.get_context())["command"][0] == CatchPhase.STOPPED


def test_it_ticks_in_its_slot_once_a_period(system):
    simulator = with_inputs(system, ball_packet(0.0, 0.5, 0.1))
    context, changed = simulator.get_context(), set()
    for k in range(60):
        for where, time in (("elsewhere", -0.02), ("tick", 0.02)):
            before = outputs(system, context)["object"][0]
            simulator.AdvanceTo(k * PERIOD + TICK + time * TIME_STEP)
            if outputs(system, context)["object"][0] != before:
                changed.add(where)
    assert changed == {"tick"}


def test_outputs_are_state_and_a_clone_replays(system):
    assert not system.HasAnyDirectFeedthrough()
    simulator = with_inputs(system, ball_packet(0.0, 0.6, 0.1))
    simulator.AdvanceTo(0.3)
    clone = Simulator(system, simulator.get_context().Clone())
    ends = []
    for each in (simulator, clone):
        each.AdvanceTo(1.2)
        ends.append(np.hstack(list(outputs(system, each.get_context()).values())))
    np.testing.assert_array_equal(*ends)
