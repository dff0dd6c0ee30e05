"""Two processes at real-time rate: the host is killed while the hand tracks, and started again."""

import json
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from drake import lcmt_drake_signal

from drake_tracker.core.errors import MachineError
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import ArmCommand
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.network.bus import open_bus
from drake_tracker.network.channels import channel_of, decode_signal
from drake_tracker.tasks import load_scenario
from drake_tracker.world.train.plant import TRAIN_HEIGHT

SETTINGS = ("vision=!Measured {}", "track.kind=circle", "track.speed=0.2", "grasp.gate=recent", "grasp.settle_time=1.5")
"""A grasp that need not wait for a lap, nor comes before a busy machine has killed the host."""
PATIENCE = 120.0
"""Wall time [s] in which a busy machine does anything of this."""


class Bus:
    """The bus as a third process sees it: the phase of the arm, and its clock."""

    def __init__(self):
        # A port of its own, so that tests that run at the same time do not meet.
        self.url = f"udpm://239.255.76.68:{random.randint(20000, 60000)}?ttl=0"
        try:
            self.lcm = open_bus(self.url)
        except MachineError as error:
            pytest.skip(str(error))
        self.phase, self.time = None, 0.0
        self.lcm.Subscribe(channel_of("command"), self._take)

    def _take(self, data):
        message = lcmt_drake_signal.decode(data)
        command = ArmCommand(decode_signal(message, ArmCommand.get_fields()))
        self.phase, self.time = Phase(int(command.phase)), 1e-3 * message.timestamp

    def wait(self, condition):
        """Listens until the condition holds. Returns the arm's time [s]."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, f"phase {self.phase} at {self.time} s"
            self.lcm.HandleSubscriptions(50)
        return self.time


@pytest.fixture
def start(tmp_path):
    """Starts ``drake-tracker`` with the given arguments; what is left of it is killed in the end."""
    processes = []

    def launch(*arguments):
        overrides = [word for setting in SETTINGS for word in ("--set", setting)]
        command = [sys.executable, "-m", "drake_tracker", *arguments, *overrides]
        processes.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return processes[-1]

    yield launch
    for process in processes:
        process.kill()
        print(*process.args[3:5], *process.communicate(), sep="\n")  # shown when the test fails


def test_without_a_host_the_arm_hovers_and_with_another_one_it_lifts_the_train(start, tmp_path):
    bus, out = Bus(), tmp_path / "arm"
    host = start("host", "train:guided", "--lcm", bus.url)
    arm = start("arm", "train:guided", "--lcm", bus.url, "--out", str(out), "--no-record", "--seed", "4")
    tracked = bus.wait(lambda: bus.phase == Phase.TRACK)
    bus.wait(lambda: bus.time > tracked + 0.3)
    host.send_signal(signal.SIGKILL)
    hovered = bus.wait(lambda: bus.phase == Phase.HOVER)
    bus.wait(lambda: bus.time > hovered + 1.3)
    another = start("host", "train:guided", "--lcm", bus.url)
    said, trouble = arm.communicate(timeout=PATIENCE)
    assert arm.returncode == 0, said + trouble
    another.send_signal(signal.SIGINT)
    said, trouble = another.communicate(timeout=PATIENCE)
    assert another.returncode == 0 and "receiving from the arm; its clock" in said, said + trouble

    assert json.loads((out / "summary.json").read_text())["success"]
    log, scenario = load_log(out / "log.npz"), load_scenario("train:guided")
    command, packet, tool, train = (log[name] for name in ("command", "delivered", "tool", "truth_train_state"))
    rows = np.nonzero(command["phase"] == Phase.HOVER)[0]
    # The longest: on a busy machine packets may be late, and the hand hover for a moment, while there is a host.
    hovering = command.times[max(np.split(rows, np.nonzero(np.diff(rows) > 1)[0] + 1), key=len)]
    assert np.ptp(hovering) > 1.3
    # It stopped as soon as the newest packet was too old, and no attempt was begun before packets came again.
    came = packet.times[1:][np.diff(packet["stamp"]) > 0]
    last = came[came < hovering[0]][-1]
    assert hovering[0] - last < scenario.servo.stale_after + 3 * SERVO_PERIOD
    assert not np.any(log["diagnosis"]["attempts"][log["diagnosis"].times <= hovering[-1]])
    # It came to rest over the place, not at home, and as high as it hovers over the reference point of a train.
    still = (tool.times > hovering[0] + 1.2) & (tool.times < hovering[-1])
    assert np.ptp(tool.data[still, :3], axis=0).max() < 0.002
    over = [np.interp(last, train.times, train[name]) for name in "xy"]
    assert np.hypot(*(tool.view("x", "y")[still][0] - over)) < 0.12
    low = tool["z"][(tool.times > hovering[0]) & (tool.times < hovering[-1])].min()
    assert low > scenario.table_height + TRAIN_HEIGHT + scenario.grasp.hover_height - 0.01
