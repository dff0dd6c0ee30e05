"""A link that carries two kinds of packets, as a Diagram."""

from typing import Any

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.link.link_system import LinkSystem


class LinkDiagram(Diagram):
    """Delivers packets of predicted path and measurements of the hand from the host to the arm.

    .. pydrake_system::

        name: LinkDiagram
        input_ports:
        - packet
        - hand_point
        output_ports:
        - delivered
        - delivered_hand_point

    The ports are those of two `LinkSystem`. ``packet`` and ``delivered`` are `Prediction` vectors, ``hand_point`` and
    ``delivered_hand_point`` `HandPoint` vectors.

    Args:
        packets: the link of the packets.
        hand_points: the link of the measurements of the hand.
    """

    def __init__(self, packets: LinkSystem, hand_points: LinkSystem) -> None:
        super().__init__()
        self.set_name("link")
        builder: Any = DiagramBuilder()
        for name, link, input_, output in (
            ("packets", packets, "packet", "delivered"),
            ("hand_points", hand_points, "hand_point", "delivered_hand_point"),
        ):
            link.set_name(name)
            builder.AddSystem(link)
            builder.ExportInput(link.GetInputPort("packet"), input_)
            builder.ExportOutput(link.GetOutputPort("delivered"), output)
        builder.BuildInto(self)
