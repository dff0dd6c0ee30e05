"""The receiver as a System, and an arm that is protected by it."""

import numpy as np
import pytest
from arm_computer import GUARD, ArmComputer
from packets import BAD_PACKETS, TABLE_HEIGHT, circle_packet, moved, with_knots
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.safety.packet_guard_system import make_packet_guard_system
from drake_tracker.core.messages import PacketReport, Prediction, message_size
from drake_tracker.core.timing import GUARD_SLOT, SERVO_PERIOD, TIME_STEP
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.train.schema import Phase

LAG = 0.25


@pytest.fixture(scope="module")
def arm():
    return ArmComputer()


def test_a_packet_passes_at_once_and_is_counted_in_the_slot_of_the_guard():
    system = make_packet_guard_system(GUARD)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    packet = system.GetInputPort("packet")
    packet.FixValue(context, np.zeros(message_size(Prediction)))
    simulator.AdvanceTo(1.0)
    good = circle_packet(1.0 - LAG)
    packet.FixValue(context, good)
    np.testing.assert_array_equal(system.GetOutputPort("accepted").Eval(context), good)
    assert not system.GetOutputPort("packet_report").Eval(context).any()
    simulator.AdvanceTo(1.0 + (GUARD_SLOT + 0.01) * TIME_STEP)
    assert PacketReport(system.GetOutputPort("packet_report").Eval(context)).received == 1
    bad = with_knots(circle_packet(1.0), moved(0, 0, -0.5, 0, 0))
    packet.FixValue(context, bad)
    np.testing.assert_array_equal(system.GetOutputPort("accepted").Eval(context), good)
    simulator.AdvanceTo(1.5)
    report = PacketReport(system.GetOutputPort("packet_report").Eval(context))
    assert (report.received, report.rejected, report.outside) == (2, 1, 1)
    np.testing.assert_array_equal(system.GetOutputPort("accepted").Eval(context), good)


def good(now, number):
    return circle_packet(now - LAG, number)


@pytest.fixture(scope="module")
def undisturbed(arm):
    return arm.run(good, 2.4)


def test_bad_packets_of_every_kind_between_good_ones_change_almost_nothing(arm, undisturbed):
    kinds = [spoil for spoil, _ in BAD_PACKETS.values()]

    def make(now, number):
        packet = good(now, number)
        return kinds[number // 2 % len(kinds)](packet) if number % 2 else packet

    logs = arm.run(make, 2.4)
    report = PacketReport(logs["packet_report"][1][-1])
    assert report.rejected > 60 and all(report[k] for k in range(3, len(report[:])))
    for name, tolerance in (("target", 0.02), ("q_commanded", 0.02)):
        disturbed = logs[name][1]
        assert np.isfinite(disturbed).all()
        fields = slice(1, 5) if name == "target" else slice(None)
        late = logs[name][0] > 1.0
        assert np.abs(disturbed - undisturbed[name][1])[late, fields].max() < tolerance
    np.testing.assert_array_equal(logs["command"][1][:, 0], undisturbed["command"][1][:, 0])


ONE_OF_EACH = {rejection.name: spoil for spoil, rejection in BAD_PACKETS.values()}


@pytest.mark.parametrize("spoil", ONE_OF_EACH.values(), ids=ONE_OF_EACH)
def test_after_nothing_but_bad_packets_the_hand_stands_still_above_the_table(arm, spoil):
    def make(now, number):
        packet = good(now, number)
        return packet if now < 1.0 else spoil(packet)

    logs = arm.run(make, 3.3)
    times, status = logs["status"]
    phase = logs["command"][1][:, 0]
    assert all(np.isfinite(rows).all() for _, rows in logs.values())
    assert set(phase[times > 2.1]) == {Phase.HOVER}
    height = status[:, 5]
    assert height.min() > TABLE_HEIGHT + 0.2
    assert np.ptp(status[times > 3.1, 3:7], axis=0).max() < 1e-6
    speed = np.abs(np.diff(logs["q_commanded"][1], axis=0)) / SERVO_PERIOD
    assert (speed.max(axis=0) <= arm.model.velocity_limit).all()


def test_the_hand_follows_again_as_soon_as_good_packets_arrive(arm):
    def make(now, number):
        packet = good(now, number)
        return packet if not 1.0 < now < 2.5 else with_knots(packet, moved(0, 0, -0.5, 0, 0))

    times, command = arm.run(make, 3.2)["command"]
    changes = np.flatnonzero(np.diff(command[:, 0])) + 1
    assert [Phase(int(phase)) for phase in command[changes, 0]] == [Phase.TRACK, Phase.HOVER, Phase.TRACK]
    assert times[changes[1]] == pytest.approx(1.0 + GraspConfig().silence, abs=0.1)
    assert times[changes[2]] == pytest.approx(2.5 + 0.2, abs=0.1)
