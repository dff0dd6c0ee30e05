"""The process of the host as a Diagram: the network to the arm, vision, and the host's computer."""

from collections.abc import Mapping

from drake import lcmt_image_array
from pydrake.lcm import DrakeLcm
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.lcm import LcmSubscriberSystem
from pydrake.systems.primitives import PassThrough
from pydrake.systems.sensors import LcmImageArrayToImages

from drake_tracker.network.channels import (
    FROM_ARM,
    FROM_HOST,
    FROM_TRACKER,
    FROM_VISION,
    POINT,
    SENDER,
    TRACKS,
    Vector,
    channel_of,
)
from drake_tracker.network.signal_system import add_receiver, add_sender


class HostSideDiagram(Diagram):
    """From the messages of the laboratory's sensors to packets of predicted path.

    .. pydrake_system::

        name: HostSideDiagram
        input_ports:
        - frame_left
        - frame_right
        - sender
        output_ports:
        - prediction

    - ``frame_left``, ``frame_right``: a `FrameInfo`, which says whether there was an image in this cycle. Without
      vision there is none of them.
    - ``sender``: values of `channels.SENDER`: the arm's run, which the host follows, and the host itself.
    - ``prediction``: the host's newest packet, a `Prediction`. All zeros: there is none yet.

    The diagram receives images or, without vision, points or tracks. It sends `channels.FROM_HOST` and, with vision,
    `channels.FROM_VISION`. A vision of several objects also sends `channels.FROM_TRACKER`. If it masks the arm, the
    diagram receives the state of the arm and of its jaws as well.

    Args:
        vision: a `VisionDiagram` or a `SeveralVisionDiagram` that takes stamps from its inputs, or None.
        host: an `EstimatorSystem`, or an `EstimatorBankSystem`.
        incoming: connection on which messages arrive.
        outgoing: connection on which messages are sent.
        vectors: {port: fields, period and offset of its channel}.

    Attributes:
        heard: names of the ports whose channels are received.
        fields: {port: names of the fields} of those that carry vectors.
    """

    def __init__(
        self,
        vision: Diagram | None,
        host: System,
        incoming: DrakeLcm,
        outgoing: DrakeLcm,
        vectors: Mapping[str, Vector],
    ) -> None:
        super().__init__()
        self.set_name("host_side")
        measured = TRACKS if host.HasInputPort("tracks") else POINT
        read: dict[str, System]
        builder = DiagramBuilder()
        builder.AddSystem(host)
        if vision is None:
            images: tuple[str, ...] = ()
            read = dict.fromkeys(measured, host)
            sent = dict.fromkeys(FROM_HOST, host)
        else:
            builder.AddSystem(vision)
            names = _input_names(vision)
            sides = [name.removeprefix("camera_") for name in names if name.startswith("camera_")]
            images = tuple(f"camera_{side}" for side in sides)
            for side in sides:
                image = _add_image_receiver(builder, lcm=incoming, port=f"camera_{side}")
                builder.Connect(image, vision.GetInputPort(f"camera_{side}"))
                builder.ExportInput(vision.GetInputPort(f"frame_{side}"), f"frame_{side}")
            read = {name: vision for name in names if name in FROM_ARM}
            for port in measured:
                builder.Connect(vision.GetOutputPort(port), host.GetInputPort(port))
            if "expected" in names:
                builder.Connect(host.GetOutputPort("expected"), vision.GetInputPort("expected"))
            sent = dict.fromkeys(FROM_HOST, host) | dict.fromkeys(FROM_VISION, vision)
            if measured == TRACKS:
                sent |= dict.fromkeys(FROM_TRACKER, vision)
        self.heard = (*images, *read)
        self.fields = {port: vectors[port].fields for port in read}
        for port, system in read.items():
            receiver = add_receiver(builder, lcm=incoming, port=port, vector=vectors[port])
            builder.Connect(receiver, system.GetInputPort(port))
        sender = builder.AddNamedSystem("sender", PassThrough(len(SENDER)))
        builder.ExportInput(sender.get_input_port(), "sender")
        for port, system in sent.items():
            signal = add_sender(builder, lcm=outgoing, port=port, vector=vectors[port], sender=sender.get_output_port())
            builder.Connect(system.GetOutputPort(port), signal)
        builder.ExportOutput(host.GetOutputPort("prediction"), "prediction")
        builder.BuildInto(self)


def _input_names(system: System) -> list[str]:
    """Returns the names of a System's input ports."""
    return [system.get_input_port(index).get_name() for index in range(system.num_input_ports())]


def _add_image_receiver(builder: DiagramBuilder, *, lcm: DrakeLcm, port: str) -> OutputPort:
    """Adds the Systems that hold the newest image of a camera's channel. Returns the output port of the image."""
    subscriber = builder.AddNamedSystem(
        f"{port}_subscriber", LcmSubscriberSystem.Make(channel_of(port), lcmt_image_array, lcm, use_cpp_serializer=True)
    )
    decoder = builder.AddNamedSystem(f"{port}_of_message", LcmImageArrayToImages())
    builder.Connect(subscriber.get_output_port(), decoder.GetInputPort("image_array_t"))
    return decoder.GetOutputPort("color_image")
