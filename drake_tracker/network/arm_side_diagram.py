"""The arm's process as a Diagram: the laboratory, the link, the arm's computer, and the network to the host."""

from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem

from drake_tracker.network.channels import FROM_ARM
from drake_tracker.network.signal_system import add_sender


class ArmSideDiagram(Diagram):
    """A `HandEyeDiagram` whose host is elsewhere, and what the arm says of itself to whoever listens.

    It has the output ports and the attributes world, vision, host, link and arm of that diagram, so that loggers,
    recorders and judges find what they look for.

    Args:
      hand_eye: a `HandEyeDiagram` with a `RemoteHostDiagram` as host. lcm: its DrakeLcm. vectors: {port: `Vector`}.
    """

    def __init__(self, hand_eye, lcm, vectors):
        super().__init__()
        self.set_name("arm_side")
        self.world, self.vision, self.host = hand_eye.world, hand_eye.vision, hand_eye.host
        self.link, self.arm = hand_eye.link, hand_eye.arm
        builder = DiagramBuilder()
        # First of all, so that at each step messages are taken in before the subscribers are asked for news.
        builder.AddSystem(LcmInterfaceSystem(lcm))
        builder.AddSystem(hand_eye)
        for port in FROM_ARM:
            builder.Connect(hand_eye.GetOutputPort(port), add_sender(builder, lcm, port, vectors[port]))
        for index in range(hand_eye.num_output_ports()):
            port = hand_eye.get_output_port(index)
            builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)
