"""The process of the arm as a Diagram: laboratory, link and arm's computer, and the network to the host."""

from collections.abc import Mapping
from typing import Any

from pydrake.lcm import DrakeLcm
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem

from drake_tracker.network.channels import FROM_ARM, Vector
from drake_tracker.network.signal_system import add_sender


class ArmSideDiagram(Diagram):
    """A `HandEyeDiagram` whose host is in another process, and publishers of the arm's state for any listener.

    It has the output ports of the hand-eye diagram, so that loggers, recorders and judges work as in one process.

    Args:
        hand_eye: a `HandEyeDiagram` with a `RemoteHostDiagram` as its host.
        lcm: the connection to the bus that the remote host uses.
        vectors: {port: fields, period and offset of its channel}.

    Attributes:
        world: the subsystem of the hand-eye diagram.
        vision: the subsystem of the hand-eye diagram.
        host: the subsystem of the hand-eye diagram.
        link: the subsystem of the hand-eye diagram.
        arm: the subsystem of the hand-eye diagram.
    """

    def __init__(self, hand_eye: Any, lcm: DrakeLcm, vectors: Mapping[str, Vector]) -> None:
        super().__init__()
        self.set_name("arm_side")
        self.world, self.vision, self.host = hand_eye.world, hand_eye.vision, hand_eye.host
        self.link, self.arm = hand_eye.link, hand_eye.arm
        builder = DiagramBuilder()
        # First, so that at each step messages are received before the subscribers are asked for them.
        builder.AddSystem(LcmInterfaceSystem(lcm))
        builder.AddSystem(hand_eye)
        for name in FROM_ARM:
            sender = add_sender(builder, lcm=lcm, port=name, vector=vectors[name])
            builder.Connect(hand_eye.GetOutputPort(name), sender)
        for index in range(hand_eye.num_output_ports()):
            port = hand_eye.get_output_port(index)
            builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)
