"""A link that carries two kinds of packets, as a Diagram."""

from typing import Any

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.link.link_system import LinkSystem


class LinkDiagram(Diagram):
    """Delivers packets of predicted path, and messages of a second kind, from the host to the arm.

    .. pydrake_system::

        name: LinkDiagram
        input_ports:
        - packet
        - (second)
        output_ports:
        - delivered
        - delivered_(second)

    The ports are those of two `LinkSystem`. ``packet`` and ``delivered`` are `Prediction` vectors. The names of the
    other two follow from that of the second message: ``hand_point``, a `HandPoint`, or ``order``, a `PickOrder`.

    Args:
        packets: the link of the packets.
        others: the link of the second message.
        name: of the second message.
    """

    def __init__(self, packets: LinkSystem, others: LinkSystem, name: str = "hand_point") -> None:
        super().__init__()
        self.set_name("link")
        builder: Any = DiagramBuilder()
        for link_name, link, input_, output in (
            ("packets", packets, "packet", "delivered"),
            (f"{name}s", others, name, f"delivered_{name}"),
        ):
            link.set_name(link_name)
            builder.AddSystem(link)
            builder.ExportInput(link.GetInputPort("packet"), input_)
            builder.ExportOutput(link.GetOutputPort("delivered"), output)
        builder.BuildInto(self)
