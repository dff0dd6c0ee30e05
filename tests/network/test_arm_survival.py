"""The process of the arm on packets that a test sends in place of the host."""

import json

import numpy as np
import pytest
from drake import lcmt_drake_signal
from packets import BAD_PACKETS, TRAIN_Z, circle_packet, with_fields
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator

from drake_tracker import load_scenario
from drake_tracker.arm.safety.packet_guard import REASONS, Rejection
from drake_tracker.core.messages import ArmCommand, Filtered, PacketReport, Prediction, ServoTarget
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.network.channels import channel_of, decode_signal, encode_signal
from drake_tracker.run.host_process import HostProcess
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks.train.two_processes import make_arm_side

AFTER_THE_HOST = 6 / 16 * TIME_STEP
LAG = 0.25
ONE_OF_EACH = {rejection: spoil for spoil, rejection in BAD_PACKETS.values()}


def train(*overrides, seed=3):
    return load_scenario("train:learned", seed=seed, overrides=["vision=!Measured {}", *overrides])


class Arm:
    """The process of the arm on a bus within this process, cycle by cycle."""

    def __init__(self, scenario):
        self.lcm = DrakeLcm("memq://")
        self.simulator = Simulator(make_arm_side(scenario, self.lcm))
        self.cycle = 0

    @property
    def now(self):
        return self.cycle * VISION_PERIOD

    def send(self, port, fields, values):
        self.lcm.Publish(channel_of(port), encode_signal(values, fields, self.now).encode())

    def packet(self, packet):
        self.send("prediction", Prediction.get_fields(), packet)

    def step(self, cycles=1):
        for _ in range(cycles):
            self.simulator.AdvanceTo(self.now + AFTER_THE_HOST)
            self.cycle += 1

    def read(self, port):
        return self.simulator.get_system().GetOutputPort(port).Eval(self.simulator.get_context())

    @property
    def report(self):
        return PacketReport(self.read("packet_report"))


@pytest.fixture(scope="module")
def arm():
    """An arm that follows good packets; the tests disturb it one after the other."""
    arm = Arm(train("grasp.settle_time=60"))
    for _ in range(60):
        arm.packet(circle_packet(arm.now - LAG, arm.cycle))
        arm.step()
    return arm


def follows(arm, cycles=4):
    """Whether the arm follows good packets after some cycles of them."""
    for _ in range(cycles):
        arm.packet(circle_packet(arm.now - LAG, arm.cycle))
        arm.step()
    target = ServoTarget(arm.read("target"))
    return target.valid and not target.stale and arm.now - target.stamp < LAG + 0.1


@pytest.mark.parametrize("rejection", REASONS, ids=lambda reason: reason.name)
def test_a_bad_packet_is_counted_and_not_used(arm, rejection):
    assert follows(arm)
    arm.step(2)  # until the servo has read the last one
    rejected, before = arm.report.rejected, ServoTarget(arm.read("target").copy())
    arm.packet(ONE_OF_EACH[rejection](circle_packet(arm.now - LAG, arm.cycle)))
    arm.step(4)
    assert (arm.report.rejected, arm.report.reason) == (rejected + 1, rejection)
    after = ServoTarget(arm.read("target"))
    assert after.stamp == before.stamp and np.isfinite(after[:]).all()
    assert np.linalg.norm(after[1:4] - before[1:4]) < 0.05
    assert follows(arm)


@pytest.mark.parametrize(
    "data", [b"", b"x" * 1000, lcmt_drake_signal().encode()[:-1], encode_signal([1.0], ["altitude"], 0.0).encode()]
)
def test_a_message_that_is_no_packet_is_counted(arm, data):
    arm.step()
    malformed = arm.report.malformed
    arm.lcm.Publish(channel_of("prediction"), data)
    arm.step(2)
    assert arm.report.malformed == malformed + 1
    assert follows(arm)


def test_a_flood_of_bad_packets_is_bounded_and_the_newest_good_one_is_used(arm):
    bad = encode_signal(with_fields(circle_packet(arm.now), spacing=1e300), Prediction.get_fields(), arm.now).encode()
    for _ in range(100_000):
        arm.lcm.Publish(channel_of("prediction"), bad)
    good = circle_packet(arm.now - LAG, arm.cycle)
    arm.packet(good)
    arm.step(3)
    np.testing.assert_array_equal(arm.read("delivered"), good)
    assert ServoTarget(arm.read("target")).stamp == Prediction(good).stamp
    assert follows(arm)


def test_signals_for_the_log_are_harmless(arm):
    for values in ([np.nan] * 7, [np.inf] * 7, [1e308] * 7):
        arm.send("filtered", Filtered.get_fields(), values)
        arm.step()
        assert np.isfinite(arm.read("filtered")).all()
    arm.lcm.Publish(channel_of("filtered"), b"x")
    arm.step()
    assert not arm.read("filtered").any() and follows(arm)


def test_in_silence_the_hand_stands_still_above_and_goes_on_with_the_packets(arm):
    follows(arm)
    arm.step(round(2.2 / VISION_PERIOD))
    assert ArmCommand(arm.read("command")).phase == Phase.HOVER
    q = arm.read("q_commanded").copy()
    arm.step(10)
    np.testing.assert_allclose(arm.read("q_commanded"), q, atol=1e-9)
    assert follows(arm, 20) and ArmCommand(arm.read("command")).phase == Phase.TRACK


class Meddler:
    """A host whose packets are spoilt from some time on; takes the place of `Progress` in a run."""

    def __init__(self, scenario, lcm, since, spoil):
        self.lcm, self.since, self.spoil = lcm, since, spoil
        self.host_lcm = DrakeLcm("memq://")
        self.host = HostProcess(scenario, lcm, self.host_lcm, tell=str)
        self.host_lcm.Subscribe(channel_of("prediction"), self._pass_on)
        self.number = 0

    def __call__(self, now, activity):
        self.host.step(0.0)
        self.host_lcm.HandleSubscriptions(0)

    def _pass_on(self, data):
        message = lcmt_drake_signal.decode(data)
        packet = np.array(decode_signal(message, Prediction.get_fields()))
        if Prediction(packet).valid and 1e-3 * message.timestamp > self.since:
            self.number += 1
            packet = self.spoil(packet, self.number)
        self.lcm.Publish(channel_of("prediction"), encode_signal(packet, Prediction.get_fields(), 0.0).encode())


@pytest.fixture
def spoilt_run(tmp_path):
    """Runs ``arm`` with a host whose packets are spoilt from 1.8 s on; returns (summary, lines for the user)."""

    def run(spoil, duration=3.2):
        scenario = train().with_settings({"duration": duration})
        lcm, lines = DrakeLcm("memq://"), []
        meddler = Meddler(scenario, lcm, 1.8, spoil)
        diagram = make_arm_side(scenario, lcm)
        options = RunOptions(record=False)
        simulate(scenario, tmp_path / "run", options, diagram=diagram, progress=meddler, tell=lines.append)
        return json.loads((tmp_path / "run" / "summary.json").read_text()), lines

    return run


def test_packets_of_every_kind_leave_a_complete_run_and_a_summary_that_names_them(spoilt_run):
    kinds = list(ONE_OF_EACH.values())
    summary, lines = spoilt_run(lambda packet, number: kinds[number % len(kinds)](packet))
    assert summary["simulated_s"] == pytest.approx(3.2)
    assert set(summary["packets_rejected_for"]) == {reason.name.lower() for reason in REASONS}
    assert summary["packets_rejected"] == sum(summary["packets_rejected_for"].values()) > 60
    assert len(lines) == len(REASONS) and all("rejecting packets from" in line for line in lines)
    assert summary["speed_share"] < 1.0 and not summary["table_touched"]


def test_knots_below_the_table_do_not_lead_the_arm_there(spoilt_run):
    """Half a metre below the table: they once drove the arm into it, at 286 % of its rated speed."""

    def sunk(packet, number):
        packet[7::5] -= 0.5
        return packet

    summary, lines = spoilt_run(sunk)
    assert not summary["table_touched"] and summary["speed_share"] < 1.0
    assert summary["packets_rejected"] > 60
    assert lines == [line for line in lines if REASONS[Rejection.OUTSIDE] in line] and len(lines) == 1


def test_the_height_of_the_train_is_that_of_the_scenario():
    assert train().table_height + 0.035 == pytest.approx(TRAIN_Z)
