"""Two arms or two hosts on one bus: each follows its own partner, and names the others."""

import numpy as np
import pytest
from packets import circle_packet
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator

from drake_tracker import load_scenario
from drake_tracker.core.messages import Prediction, TrackPoint
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.network.channels import channel_of, encode_signal
from drake_tracker.network.cycles import SILENCE, SenderLock
from drake_tracker.run.host_process import HostProcess
from drake_tracker.tasks.train.two_processes import make_arm_side

AFTER_THE_HOST = 6 / 16 * TIME_STEP
A, B = (101.0, 0.0), (202.0, 0.0)


def scenario(*overrides):
    return load_scenario("train:learned", seed=3, overrides=["vision=!Measured {}", *overrides])


def advance(arm, cycle):
    arm.AdvanceTo(cycle * VISION_PERIOD + AFTER_THE_HOST)


def delivered(arm):
    return np.array(arm.get_system().GetOutputPort("delivered").Eval(arm.get_context()))


def test_a_host_follows_the_first_of_two_arms_and_the_other_arm_uses_nothing_of_it():
    """Arm B once followed the train of arm A."""
    lcm, of_host, of_b = DrakeLcm("memq://"), [], []
    host = HostProcess(scenario(), lcm, lcm, tell=of_host.append)
    arm_a = Simulator(make_arm_side(scenario("track.speed=0.2"), lcm, str))
    arm_b = Simulator(make_arm_side(scenario("track.speed=0.1"), lcm, of_b.append))
    alone_lcm = DrakeLcm("memq://")
    alone_host = HostProcess(scenario(), alone_lcm, alone_lcm, tell=str)
    alone = Simulator(make_arm_side(scenario("track.speed=0.2"), alone_lcm, str))
    for cycle in range(60):
        for arm in (arm_a, arm_b, alone):
            advance(arm, cycle)
        host.step(0.0)
        alone_host.step(0.0)
        np.testing.assert_array_equal(delivered(arm_a), delivered(alone))
    assert Prediction(delivered(arm_a)).valid and not Prediction(delivered(arm_b)).valid
    assert [line for line in of_host if "another arm" in line] == of_host[1:] and len(of_host) == 2
    assert len(of_b) == 1 and "another run" in of_b[0]


class OneArm:
    """An arm on which packets of several hosts arrive."""

    def __init__(self):
        self.lcm, self.lines = DrakeLcm("memq://"), []
        diagram = make_arm_side(scenario(), self.lcm, self.lines.append)
        self.simulator, self.cycle = Simulator(diagram), 0
        remote = diagram.host
        self.run = remote._run

    def send(self, *sender):
        advance(self.simulator, self.cycle)
        packet = circle_packet(self.cycle * VISION_PERIOD)
        message = encode_signal(packet, Prediction.get_fields(), self.cycle * VISION_PERIOD, sender)
        self.lcm.Publish(channel_of("prediction"), message.encode())
        self.cycle += 1
        advance(self.simulator, self.cycle)
        self.cycle += 1
        advance(self.simulator, self.cycle)
        return Prediction(delivered(self.simulator)).stamp


def test_an_arm_follows_the_first_of_two_hosts():
    arm = OneArm()
    used = arm.send(arm.run, 1.0)
    assert used > 0.0 or arm.send(arm.run, 1.0) > 0.0
    used = Prediction(delivered(arm.simulator)).stamp
    assert arm.send(arm.run, 2.0) == used and arm.send(arm.run, 2.0) == used
    assert arm.lines == ["ignoring the messages of another host on the bus, 2"]
    assert arm.send(arm.run, 1.0) > used


@pytest.mark.parametrize("sender", [(7.0, 1.0), (np.nan, 1.0), (-1.0, 1.0), (np.inf, 0.0)])
def test_packets_of_another_run_are_not_used(sender):
    arm = OneArm()
    arm.send(*sender)
    assert arm.send(*sender) == 0.0 and len(arm.lines) == 1 and "another run" in arm.lines[0]


def test_a_host_that_names_no_run_is_followed():
    arm = OneArm()
    arm.send()
    assert arm.send() > 0.0 and not arm.lines


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def test_another_sender_is_followed_once_the_first_is_silent():
    clock, lines = Clock(), []
    lock = SenderLock("arm", lines.append, clock)
    assert lock.accepts(1.0)
    clock.now = SILENCE
    assert not lock.accepts(2.0) and lock.accepts(1.0)
    clock.now += 1.01 * SILENCE
    assert lock.accepts(2.0) and not lock.accepts(1.0)
    assert lines == [f"ignoring the messages of another arm on the bus, {k}" for k in (2, 1)]


def test_of_many_senders_some_are_named():
    lines = []
    lock = SenderLock("arm", lines.append, Clock())
    assert [lock.accepts(float(k)) for k in range(100)] == [True] + 99 * [False] and len(lines) == 20


def test_a_host_begins_anew_with_another_run_whose_clock_goes_on():
    lcm, clock, lines = DrakeLcm("memq://"), Clock(), []
    host = HostProcess(scenario(), lcm, lcm, tell=lines.append, clock=clock)

    def point(cycle, sender):
        values = [cycle * VISION_PERIOD - 0.25, 0.56, 0.002 * cycle, 0.48, 0.001, 1.0]
        message = encode_signal(values, TrackPoint.get_fields(), cycle * VISION_PERIOD, sender)
        lcm.Publish(channel_of("point"), message.encode())
        return host.step(0.0)

    assert [point(cycle, A) for cycle in range(60, 63)] == [1, 1, 1]
    assert point(63, B) == 0
    clock.now = 2.0 * SILENCE
    assert [point(cycle, B) for cycle in range(64, 67)] == [1, 1, 1]
    assert host.counts["laboratories"] == 2 and host.counts["cycles"] == 6
