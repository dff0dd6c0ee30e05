"""The process of the arm as a Diagram: laboratory, link and arm's computer, and the network to the host."""

from collections.abc import Iterable, Mapping
from typing import Any

from drake import lcmt_image_array
from pydrake.lcm import DrakeLcm
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem, LcmPublisherSystem
from pydrake.systems.sensors import ImageToLcmImageArrayT, PixelType

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.network.channels import FROM_ARM, Vector, channel_of
from drake_tracker.network.signal_system import add_receiver, add_sender


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


class ImageSenderDiagram(Diagram):
    """Sends the images of the cameras, in place of vision.

    .. pydrake_system::

        name: ImageSenderDiagram
        input_ports:
        - camera_left
        - camera_right

    - ``camera_left``, ``camera_right``: an ImageRgba8U, published 60 times a second in the slot in which vision would
      read it.

    Args:
        lcm: connection to the bus.
        cameras: names of the ports.
    """

    def __init__(self, lcm: DrakeLcm, cameras: Iterable[str]) -> None:
        super().__init__()
        self.set_name("image_sender")
        builder = DiagramBuilder()
        for name in cameras:
            encoder = builder.AddNamedSystem(f"{name}_to_message", ImageToLcmImageArrayT())
            image = encoder.DeclareImageInputPort[PixelType.kRgba8U](name)
            publisher = builder.AddNamedSystem(
                f"{name}_publisher",
                LcmPublisherSystem.Make(
                    channel_of(name), lcmt_image_array, lcm, publish_period=VISION_PERIOD, use_cpp_serializer=True
                ),
            )
            builder.Connect(encoder.get_output_port(), publisher.get_input_port())
            builder.ExportInput(image, name)
        builder.BuildInto(self)


class RemoteHostDiagram(Diagram):
    """Represents a host in another process.

    .. pydrake_system::

        name: RemoteHostDiagram
        input_ports:
        - point
        output_ports:
        - prediction
        - filtered

    - ``point``: a `TrackPoint`, published 60 times a second just before the host's slot. All zeros: no point yet.
    - ``prediction``: the newest `Prediction` received, which the arm's guard judges. All NaN: the newest message cannot
      be read. All zeros: none yet.
    - ``filtered``: the newest `Filtered` received. All zeros: none yet, or the newest message cannot be used.

    These are the ports with measured vision: the inputs are the sent ports, the outputs the received ports. With
    cameras there is no input, and `channels.FROM_VISION` are outputs too. With several objects ``tracks`` takes the
    place of ``point``, and with cameras `channels.FROM_TRACKER` are further outputs.

    Args:
        lcm: connection to the bus, with an LcmInterfaceSystem elsewhere.
        sent: names of the ports that are sent.
        heard: names of the ports that are received.
        vectors: {port: fields, period and offset of its channel}.
    """

    def __init__(self, lcm: DrakeLcm, sent: Iterable[str], heard: Iterable[str], vectors: Mapping[str, Vector]) -> None:
        super().__init__()
        self.set_name("remote_host")
        builder = DiagramBuilder()
        for port in sent:
            builder.ExportInput(add_sender(builder, lcm=lcm, port=port, vector=vectors[port]), port)
        for port in heard:
            faults = port == "prediction"
            builder.ExportOutput(add_receiver(builder, lcm=lcm, port=port, vector=vectors[port], faults=faults), port)
        builder.BuildInto(self)
