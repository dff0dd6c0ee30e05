"""The host's process as a Diagram: the network to the arm, the image processor, the host's computer."""

from drake import lcmt_image_array
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.lcm import LcmSubscriberSystem
from pydrake.systems.sensors import LcmImageArrayToImages

from drake_tracker.network.channels import FROM_HOST, FROM_VISION, POINT, channel_of
from drake_tracker.network.signal_system import add_receiver, add_sender


class HostSideDiagram(Diagram):
    """From what the laboratory's sensors send to packets of predicted path.

    .. pydrake_system::

        name: HostSideDiagram
        input_ports:
        - frame_left
        - frame_right
        output_ports:
        - prediction

    It hears images or, without a ``vision``, points, and sends `channels.FROM_HOST`, with a vision `FROM_VISION` as
    well. ``frame_*`` is a `FrameInfo`: whether there was an image in this cycle; without a vision there are no inputs.
    ``heard`` names the ports whose channels it hears.

    Args:
      vision: a `VisionDiagram` with stamps of its own, or None. host: an `EstimatorSystem`.
      incoming: the DrakeLcm from which messages come. outgoing: the one to which they go. vectors: {port: `Vector`}.
    """

    def __init__(self, vision, host, incoming, outgoing, vectors):
        super().__init__()
        self.set_name("host_side")
        builder = DiagramBuilder()
        builder.AddSystem(host)
        if vision is None:
            self.heard = POINT
            builder.Connect(add_receiver(builder, incoming, "point", vectors["point"]), host.GetInputPort("point"))
            sent = dict.fromkeys(FROM_HOST, host)
        else:
            builder.AddSystem(vision)
            sides = [name.removeprefix("camera_") for name in port_names(vision) if name.startswith("camera_")]
            self.heard = tuple(f"camera_{side}" for side in sides)
            for side in sides:
                image = _add_image_receiver(builder, incoming, f"camera_{side}")
                builder.Connect(image, vision.GetInputPort(f"camera_{side}"))
                builder.ExportInput(vision.GetInputPort(f"frame_{side}"), f"frame_{side}")
            builder.Connect(vision.GetOutputPort("point"), host.GetInputPort("point"))
            sent = dict.fromkeys(FROM_HOST, host) | dict.fromkeys(FROM_VISION, vision)
        for port, system in sent.items():
            builder.Connect(system.GetOutputPort(port), add_sender(builder, outgoing, port, vectors[port]))
        builder.ExportOutput(host.GetOutputPort("prediction"), "prediction")
        builder.BuildInto(self)


def port_names(system):
    """Returns the names of a System's input ports."""
    return [system.get_input_port(index).get_name() for index in range(system.num_input_ports())]


def _add_image_receiver(builder, lcm, port):
    """Adds what holds the newest image of a camera's channel. Returns the output port."""
    subscriber = builder.AddNamedSystem(
        f"{port}_subscriber", LcmSubscriberSystem.Make(channel_of(port), lcmt_image_array, lcm, use_cpp_serializer=True)
    )
    decoder = builder.AddNamedSystem(f"{port}_of_message", LcmImageArrayToImages())
    builder.Connect(subscriber.get_output_port(), decoder.GetInputPort("image_array_t"))
    return decoder.GetOutputPort("color_image")
