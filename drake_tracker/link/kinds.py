"""The kinds of link. A new kind is registered here, and only here."""

from typing import Any

from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_tracker.core.kinds import Kinds
from drake_tracker.core.timing import LINK_SLOT, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.link.config import LinkSettings, Lossy, Perfect
from drake_tracker.link.link import Link
from drake_tracker.link.link_system import LinkSystem
from drake_tracker.link.lossy_link import LossyLink


def perfect(settings: Perfect, *, seed: int = 0) -> LossyLink:
    """Returns a link that loses and delays nothing. The seed has no effect."""
    return LossyLink(seed=seed)


def lossy(settings: Lossy, *, seed: int = 0) -> LossyLink:
    """Returns a link with the given faults, drawn from the seed."""
    return LossyLink(settings, seed)


LINKS: Kinds[Link[Any]] = Kinds("link", {Perfect: perfect, Lossy: lossy})
"""The kinds of link; `Kinds.make` returns the arithmetic of one (`Link`)."""


def make_link(
    settings: LinkSettings, *, seed: int = 0, time_step: float = TIME_STEP, period: float = VISION_PERIOD
) -> LinkSystem:
    """Returns the System of a link, named "link".

    Args:
        settings: an instance of one of the kinds in `LINKS`.
        seed: seed of the random losses and delays.
        time_step: the plant's step [s], of which the link's slot is a fraction.
        period: time between two packets [s].

    Raises DrakeTrackerError for settings of no kind, or out of range.
    """
    link = LinkSystem(LINKS.make(settings, seed=seed), period=period, offset=vision_slot(LINK_SLOT, time_step))
    link.set_name("link")
    return link


def add_link(
    builder: DiagramBuilder,
    *,
    settings: LinkSettings,
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
