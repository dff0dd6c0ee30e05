"""What stands in the arm's process for the image processor and the host: what it sends to them, and hears from them."""

from drake import lcmt_image_array
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.lcm import LcmPublisherSystem
from pydrake.systems.sensors import ImageToLcmImageArrayT, PixelType

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.network.channels import channel_of
from drake_tracker.network.signal_system import add_receiver, add_sender


class ImageSenderDiagram(Diagram):
    """Sends the cameras' images, in the place of vision.

    .. pydrake_system::

        name: ImageSenderDiagram
        input_ports:
        - camera_left
        - camera_right

    Both are ImageRgba8U and go out 60 times a second, in the slot in which vision would read them.

    Args:
      lcm: a DrakeLcm. cameras: names of the ports.
    """

    def __init__(self, lcm, cameras):
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
    """Stands for a host in another process.

    .. pydrake_system::

        name: RemoteHostDiagram
        input_ports:
        - point
        output_ports:
        - prediction
        - filtered

    The inputs are what is ``sent``, the outputs what is ``heard``, all zeros until it is; these are the ports where
    vision is measured. Where there are cameras there is no input, and `channels.FROM_VISION` are outputs as well.

    Args:
      lcm: a DrakeLcm, to which somebody else's LcmInterfaceSystem attends. sent, heard: ports by their names.
      vectors: {port: `Vector`}.
    """

    def __init__(self, lcm, sent, heard, vectors):
        super().__init__()
        self.set_name("remote_host")
        builder = DiagramBuilder()
        for port in sent:
            builder.ExportInput(add_sender(builder, lcm, port, vectors[port]), port)
        for port in heard:
            builder.ExportOutput(add_receiver(builder, lcm, port, vectors[port]), port)
        builder.BuildInto(self)
