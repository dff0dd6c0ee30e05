"""The serial line between the host that predicts and the arm's controller: packets are lost, late and out of order.

Allen et al. 1991, section 4.4: "the asynchronous nature of the communication [...] can result in missed or delayed
communications". The link judges no packet; the receiver does (`arm/safety/packet_guard.py`). Random numbers are
counter-based: whether a packet is lost or late depends only on the seed, on its sequence number, and in bursts on
whether the packet before it was lost.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import Prediction
from drake_tracker.core.timing import PATH_DURATION
from drake_tracker.link.config import Lossy, Perfect

LINK_STREAM = 40
"""The link's stream of random numbers: default_rng([seed, LINK_STREAM, seq])."""


@dataclass(frozen=True)
class LinkState(FrozenState):
    """Memory of the link.

    Attributes:
        in_flight: (time of arrival [s], read-only packet) of each packet under way, in the order of sending.
        last_stamp: stamp [s] of the packet offered last, None before the first.
        last_lost: whether the packet offered last was lost.
    """

    in_flight: tuple[tuple[float, np.ndarray], ...] = ()
    last_stamp: float | None = None
    last_lost: bool = False


@dataclass(frozen=True)
class LossyLink:
    """A link with the given faults; with the default settings it is perfect. Implements `drake_tracker.link.Link`.

    Attributes:
        settings: losses and delays.
        seed: seed of the random numbers, 0 or more.
        message: type of the packets, with the fields ``stamp``, ``seq`` and ``valid``.

    Raises DrakeTrackerError when a number is out of range.
    """

    settings: Lossy = Lossy()
    seed: int = 0
    message: Any = Prediction

    def __post_init__(self) -> None:
        settings = self.settings
        for name, value, allowed, ok in (
            ("drop", settings.drop, "0 to 1", 0.0 <= settings.drop <= 1.0),
            ("delay", settings.delay, "0 s or more", 0.0 <= settings.delay < math.inf),
            ("jitter", settings.jitter, "0 s or more", 0.0 <= settings.jitter < math.inf),
            ("burst", settings.burst, "1 packet or more", 1.0 <= settings.burst < math.inf),
            ("seed", self.seed, "0 or a positive integer", self.seed >= 0),
        ):
            if not ok:
                raise DrakeTrackerError(f"link {name} is {value}; allowed: {allowed}")

    def initial_state(self) -> LinkState:
        """Returns the state before the first packet."""
        return LinkState()

    def post(self, state: LinkState, packet: np.ndarray, now: float) -> LinkState:
        """Returns the state after a packet was offered to the link.

        A packet is not sent if its ``valid`` is 0, or if its stamp equals the stamp of the packet offered last.

        Args:
            state: the state before.
            packet: a vector of the link's message type.
            now: time [s] on the arm's clock.
        """
        fields = self.message(packet)
        stamp = fields.stamp
        if fields.valid == 0.0 or _same(stamp, state.last_stamp):
            return state
        loss_draw, jitter_draw = self._draw(fields.seq)
        lost = bool(loss_draw < self._loss_probability(state))
        in_flight = self._without_superseded(state.in_flight, now)
        if not lost:
            arrival = now + self.settings.delay + self.settings.jitter * jitter_draw
            in_flight += ((arrival, read_only(np.array(packet, dtype=float))),)
        return LinkState(in_flight=in_flight, last_stamp=float(stamp), last_lost=lost)

    def delivered(self, state: LinkState, now: float) -> np.ndarray | None:
        """Returns the packet with the newest stamp that has arrived by ``now`` [s], None when none has.

        A packet overtaken by a newer one never replaces it. Stamps decide and not sequence numbers, since a restarted
        host counts its packets from 1 again. A packet whose stamp has no place in this order, because it was later than
        the arm's clock at its arrival or its path was over, is delivered until the next packet arrives.
        """
        return self._newest_arrived(state.in_flight, now)

    def _draw(self, seq: float) -> tuple[float, float]:
        """Returns two uniform random numbers, which decide on the loss and the jitter of a packet."""
        if self.settings.drop == 0.0 and self.settings.jitter == 0.0:
            return 0.0, 0.0  # the draws decide nothing, and they take longer than everything else
        number = int(seq) if 0.0 <= seq < math.inf else 0  # a sender that is not ours may count in any way
        loss_draw, jitter_draw = np.random.default_rng([self.seed, LINK_STREAM, number]).random(2)
        return loss_draw, jitter_draw

    def _loss_probability(self, state: LinkState) -> float:
        drop = self.settings.drop
        if state.last_stamp is None or drop == 1.0:
            return drop
        again = max(drop, 1.0 - 1.0 / self.settings.burst)
        # The first loss of a burst must be this rare for a fraction ``drop`` to be lost in the long run.
        return again if state.last_lost else drop * (1.0 - again) / (1.0 - drop)

    def _newest_arrived(self, in_flight: tuple[tuple[float, np.ndarray], ...], now: float) -> np.ndarray | None:
        arrived = [item for item in in_flight if item[0] <= now]
        if not arrived:
            return None
        last = max(reversed(arrived), key=lambda item: item[0])
        if not self._has_order(*last):
            return last[1]
        return max((packet for arrival, packet in arrived if self._has_order(arrival, packet)), key=self._stamp)

    def _without_superseded(
        self, in_flight: tuple[tuple[float, np.ndarray], ...], now: float
    ) -> tuple[tuple[float, np.ndarray], ...]:
        """Returns the packets in transit, the delivered packet, and the newest packet that has arrived."""
        delivered = self._newest_arrived(in_flight, now)
        if delivered is None:
            return in_flight
        ordered = [packet for arrival, packet in in_flight if arrival <= now and self._has_order(arrival, packet)]
        newest = max(ordered, key=self._stamp, default=None)
        return tuple(item for item in in_flight if item[0] > now or item[1] is delivered or item[1] is newest)

    def _has_order(self, arrival: float, packet: np.ndarray) -> bool:
        """Returns whether the stamp of a packet that arrived at ``arrival`` [s] tells which of two packets is newer."""
        return bool(arrival - PATH_DURATION <= self._stamp(packet) <= arrival)

    def _stamp(self, packet: np.ndarray) -> float:
        return self.message(packet).stamp


def _same(stamp: float, other: float | None) -> bool:
    """Returns whether two stamps are the same; NaN is equal to itself here."""
    return stamp == other or (other is not None and math.isnan(stamp) and math.isnan(other))


def perfect_link(settings: Perfect, seed: int = 0, message: Any = Prediction) -> LossyLink:
    """Returns a link that delivers every packet at once. The seed has no effect."""
    return LossyLink(seed=seed, message=message)
