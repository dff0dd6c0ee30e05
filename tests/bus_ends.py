"""Host and arm as receivers of messages that a test sends them."""

import numpy as np
from arm_computer import GUARD
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem

from drake_tracker import load_scenario
from drake_tracker.arm.safety.packet_guard_system import make_packet_guard_system
from drake_tracker.core.messages import TrackPoint
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.network.channels import channel_of, encode_signal, vectors
from drake_tracker.network.signal_system import add_receiver
from drake_tracker.run.host_process import HostProcess


class Bench:
    """A host that receives good points between the messages of the fuzzer."""

    def __init__(self):
        self.lcm = DrakeLcm("memq://")
        scenario = load_scenario("train:learned", overrides=["vision=!Measured {}"])
        self.host = HostProcess(scenario, self.lcm, self.lcm, tell=str)
        self.cycle = 0
        self.packets = 0
        self.lcm.Subscribe(channel_of("prediction"), self._count)

    def _count(self, data):
        self.packets += 1

    def good(self, count):
        for _ in range(count):
            angle = self.cycle * VISION_PERIOD
            stamp = self.cycle * VISION_PERIOD - 0.25
            point = [stamp, 0.56 + 0.15 * np.cos(angle), 0.15 * np.sin(angle), 0.485, 0.001, 1.0]
            message = encode_signal(point, TrackPoint.get_fields(), self.cycle * VISION_PERIOD + 0.0008)
            self.lcm.Publish(channel_of("point"), message.encode())
            self.host.step(0.0)
            self.cycle += 1


class Receiver:
    """The arm's receiver on a bus: messages become vectors, which the guard judges."""

    def __init__(self):
        self.lcm = DrakeLcm("memq://")
        builder = DiagramBuilder()
        builder.AddSystem(LcmInterfaceSystem(self.lcm))
        known = vectors(TIME_STEP)
        guard = builder.AddSystem(make_packet_guard_system(GUARD))
        packet = add_receiver(builder, lcm=self.lcm, port="prediction", vector=known["prediction"], faults=True)
        builder.Connect(packet, guard.GetInputPort("packet"))
        builder.ExportOutput(add_receiver(builder, lcm=self.lcm, port="filtered", vector=known["filtered"]), "filtered")
        for name in ("accepted", "packet_report"):
            builder.ExportOutput(guard.GetOutputPort(name), name)
        self.simulator = Simulator(builder.Build())
        self.simulator.AdvanceTo(10.0)

    def read(self, name):
        return self.simulator.get_system().GetOutputPort(name).Eval(self.simulator.get_context())

    def advance(self):
        self.simulator.AdvanceTo(self.simulator.get_context().get_time() + VISION_PERIOD)
