"""The process of the arm as a Diagram: laboratory, link and arm's computer, and the network to the host."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

from drake import lcmt_drake_signal, lcmt_image_array
from pydrake.lcm import DrakeLcm
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.lcm import LcmInterfaceSystem, LcmPublisherSystem
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ImageToLcmImageArrayT, PixelType

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.network.channels import FROM_ARM, Vector, channel_of, sender_of
from drake_tracker.network.cycles import SenderLock
from drake_tracker.network.signal_system import add_receiver, add_sender


class ArmSideDiagram(Diagram):
    """A `HandEyeDiagram` whose host is in another process, and publishers of the arm's state for any listener.

    It has the output ports of the hand-eye diagram, so that loggers, recorders and judges work as in one process.

    Args:
        hand_eye: a `HandEyeDiagram` with a `RemoteHostDiagram` as its host.
        lcm: the connection to the bus that the remote host uses.
        vectors: {port: fields, period and offset of its channel}.
        run: identifier of the run, which every message names.

    Attributes:
        world: the subsystem of the hand-eye diagram.
        vision: the subsystem of the hand-eye diagram.
        host: the subsystem of the hand-eye diagram.
        link: the subsystem of the hand-eye diagram.
        arm: the subsystem of the hand-eye diagram.
    """

    def __init__(self, hand_eye: Any, lcm: DrakeLcm, vectors: Mapping[str, Vector], run: int) -> None:
        super().__init__()
        self.set_name("arm_side")
        self.world, self.vision, self.host = hand_eye.world, hand_eye.vision, hand_eye.host
        self.link, self.arm = hand_eye.link, hand_eye.arm
        builder = DiagramBuilder()
        # First, so that at each step messages are received before the subscribers are asked for them.
        builder.AddSystem(LcmInterfaceSystem(lcm))
        builder.AddSystem(hand_eye)
        sender = _add_sender_name(builder, run)
        for name in FROM_ARM:
            signal = add_sender(builder, lcm=lcm, port=name, vector=vectors[name], sender=sender)
            builder.Connect(hand_eye.GetOutputPort(name), signal)
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
        run: identifier of the run, which the name of each image's frame contains.
    """

    def __init__(self, lcm: DrakeLcm, cameras: Iterable[str], run: int) -> None:
        super().__init__()
        self.set_name("image_sender")
        builder = DiagramBuilder()
        for name in cameras:
            encoder = builder.AddNamedSystem(f"{name}_to_message", ImageToLcmImageArrayT())
            image = encoder.DeclareImageInputPort[PixelType.kRgba8U](f"{name} run {run}")
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

    Messages for other runs, and those of a second host, are ignored and reported (`SenderLock`).

    Args:
        lcm: connection to the bus, with an LcmInterfaceSystem before this one.
        sent: names of the ports that are sent.
        heard: names of the ports that are received.
        vectors: {port: fields, period and offset of its channel}.
        run: identifier of the run, which every message names.
        tell: called with each line of news for the user.
    """

    def __init__(
        self,
        lcm: DrakeLcm,
        sent: Iterable[str],
        heard: Iterable[str],
        vectors: Mapping[str, Vector],
        run: int,
        tell: Callable[[str], object] = print,
    ) -> None:
        super().__init__()
        self.set_name("remote_host")
        self._run = float(run)
        self._runs, self._hosts = SenderLock("run", tell), SenderLock("host", tell)
        self._inside = DrakeLcm("memq://")
        builder = DiagramBuilder()
        builder.AddSystem(LcmInterfaceSystem(self._inside))
        sender = _add_sender_name(builder, run)
        for port in sent:
            signal = add_sender(builder, lcm=lcm, port=port, vector=vectors[port], sender=sender)
            builder.ExportInput(signal, port)
        for port in heard:
            lcm.Subscribe(channel_of(port), partial(self._pass_on, channel_of(port)))
            signal = add_receiver(
                builder, lcm=self._inside, port=port, vector=vectors[port], faults=port == "prediction"
            )
            builder.ExportOutput(signal, port)
        builder.BuildInto(self)

    def _pass_on(self, channel: str, data: bytes) -> None:
        """Publishes a message on the bus inside, unless it is for another run or comes from a second host."""
        try:
            run, host = sender_of(lcmt_drake_signal.decode(data))
        except Exception:  # garbage can raise anything in the generated decoder; the arm's guard counts it
            self._inside.Publish(channel, data)
            return
        if run not in (0.0, self._run):
            self._runs.ignore(run)
        elif self._hosts.accepts(host):
            self._inside.Publish(channel, data)


def _add_sender_name(builder: DiagramBuilder, run: int) -> OutputPort:
    """Adds the source of `channels.SENDER` in the messages of an arm. Returns its output port."""
    return builder.AddNamedSystem("sender", ConstantVectorSource([float(run), 0.0])).get_output_port()
