"""Faults of the link: for a time, another link takes the place of the scenario's."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import Prediction
from drake_tracker.faults.config import LinkBursts, LinkDelay, LinkJitter, LinkLoss
from drake_tracker.faults.fault import LinkFault
from drake_tracker.link.config import Lossy
from drake_tracker.link.link import Link
from drake_tracker.link.lossy_link import LossyLink


@dataclass(frozen=True)
class LossyLinkFault(LinkFault):
    """`LinkLoss`, `LinkBursts`, `LinkJitter` and `LinkDelay`: a `LossyLink` while the fault lasts."""

    def lossy(self) -> Lossy:
        """Returns the settings of the link while the fault lasts."""
        settings = self.settings
        if isinstance(settings, LinkLoss):
            return Lossy(drop=settings.drop)
        if isinstance(settings, LinkBursts):
            return Lossy(drop=settings.drop, burst=settings.burst)
        if isinstance(settings, LinkJitter):
            return Lossy(jitter=settings.jitter)
        assert isinstance(settings, LinkDelay)
        return Lossy(delay=settings.delay)

    def link(self, link: Link[Any], message: Any = Prediction) -> Link[Any]:
        return SubstitutedLink(link, LossyLink(self.lossy(), self.seed + self.number, message), self, message)


@dataclass(frozen=True)
class SubstitutedState(FrozenState):
    """State of a `SubstitutedLink`.

    Attributes:
        usual: state of the usual link.
        faulty: state of the link that takes its place.
    """

    usual: Any
    faulty: Any


@dataclass(frozen=True)
class SubstitutedLink:
    """A link whose packets take another link while a fault lasts. Implements `drake_tracker.link.Link`.

    Packets under way when the fault begins or ends still arrive.

    Attributes:
        usual: the usual link.
        faulty: the link that takes its place.
        fault: the fault.
        message: type of the packets.
    """

    usual: Link[Any]
    faulty: Link[Any]
    fault: LinkFault
    message: Any = Prediction

    def initial_state(self) -> SubstitutedState:
        """Returns the state before the first packet."""
        return SubstitutedState(self.usual.initial_state(), self.faulty.initial_state())

    def post(self, state: SubstitutedState, packet: np.ndarray, now: float) -> SubstitutedState:
        """Returns the state after a packet was offered at a time ``now`` [s]; see `Link.post`."""
        if self.fault.active(now):
            return SubstitutedState(state.usual, self.faulty.post(state.faulty, packet, now))
        return SubstitutedState(self.usual.post(state.usual, packet, now), state.faulty)

    def delivered(self, state: SubstitutedState, now: float) -> np.ndarray | None:
        """Returns the packet with the newest stamp that has arrived by ``now`` [s]; see `Link.delivered`."""
        packets = [self.usual.delivered(state.usual, now), self.faulty.delivered(state.faulty, now)]
        arrived = (packet for packet in packets if packet is not None)
        return max(arrived, key=lambda packet: self.message(packet).stamp, default=None)
