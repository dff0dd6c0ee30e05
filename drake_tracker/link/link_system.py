"""A link as a System, and a Diagram of the links of two kinds of packets."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort, State

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Prediction, message_size
from drake_tracker.core.timing import LINK_SLOT, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.link.link import LINKS, Link


class LinkSystem(LeafSystem):
    """Delivers packets of predicted path from the host to the arm.

    The output is a mailbox: it holds the newest packet that has arrived, until a newer one arrives.

    .. pydrake_system::

        name: LinkSystem
        input_ports:
        - packet
        output_ports:
        - delivered

    - ``packet``: a `Prediction`, read every period at the offset, by default 60 times a second in the link's slot,
      after the estimator's. All zeros, or the packet of the last period again: nothing is sent.
    - ``delivered``: a `Prediction`. It may change at any time, also between two periods. All zeros: no packet has
      arrived yet. There is no direct feedthrough.

    Args:
        link: decides when each packet arrives, if it does.
        period: sampling period of the input [s].
        offset: time of the first sample [s].
        message: type of the packets.
    """

    def __init__(
        self,
        link: Link[Any],
        *,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(LINK_SLOT),
        message: Any = Prediction,
    ) -> None:
        LeafSystem.__init__(self)
        self._link = link
        size = message_size(message)
        self._nothing = read_only(np.zeros(size))
        self._packet = self.DeclareVectorInputPort("packet", size)
        self._state_index = self.DeclareAbstractState(AbstractValue.Make(link.initial_state()))
        self.DeclareVectorOutputPort(
            "delivered",
            size,
            self._calc_delivered,
            prerequisites_of_calc={self.abstract_state_ticket(self._state_index), self.time_ticket()},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._post)

    def _post(self, context: Context, state: State) -> None:
        memory = context.get_abstract_state(self._state_index).get_value()
        posted = self._link.post(memory, self._packet.Eval(context), context.get_time())
        state.get_mutable_abstract_state(self._state_index).set_value(posted)

    def _calc_delivered(self, context: Context, output: Any) -> None:
        memory = context.get_abstract_state(self._state_index).get_value()
        packet = self._link.delivered(memory, context.get_time())
        output.SetFromVector(self._nothing if packet is None else packet)


def make_link(
    settings: Any,
    *,
    seed: int = 0,
    time_step: float = TIME_STEP,
    period: float = VISION_PERIOD,
    wrap: Callable[[Link[Any]], Link[Any]] | None = None,
    message: Any = Prediction,
) -> LinkSystem:
    """Returns the System of a link, named "link".

    Args:
        settings: an instance of one of the kinds in `LINKS`.
        seed: seed of the random losses and delays.
        time_step: the plant's step [s], of which the link's slot is a fraction.
        period: time between two packets [s].
        wrap: makes the link that is used of the one that the settings describe; None uses that one.
        message: type of the packets.

    Raises DrakeTrackerError for settings of no kind, or out of range.
    """
    arithmetic = LINKS.make(settings, seed=seed, message=message)
    if wrap is not None:
        arithmetic = wrap(arithmetic)
    link = LinkSystem(arithmetic, period=period, offset=vision_slot(LINK_SLOT, time_step), message=message)
    link.set_name("link")
    return link


def add_link(
    builder: DiagramBuilder,
    *,
    settings: Any,
    packet: OutputPort | None = None,
    seed: int = 0,
    time_step: float = TIME_STEP,
    period: float = VISION_PERIOD,
) -> LinkSystem:
    """Adds a link to a diagram under construction, and returns it.

    Args:
        builder: the diagram's builder.
        settings: an instance of one of the kinds in `LINKS`.
        packet: output port of the packets to deliver (`Prediction`); None leaves the input unconnected.
        seed: seed of the random losses and delays.
        time_step: the plant's step [s], of which the link's slot is a fraction.
        period: time between two packets [s].

    Raises DrakeTrackerError for settings of no kind, or out of range.
    """
    link = builder.AddSystem(make_link(settings, seed=seed, time_step=time_step, period=period))
    if packet is not None:
        builder.Connect(packet, link.GetInputPort("packet"))
    return link


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
