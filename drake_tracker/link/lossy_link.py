"""The serial line between the host that predicts and the arm's controller: packets lost, late and out of order.

Allen et al. 1991, section 4.4: "the asynchronous nature of the communication [...] can result in missed or delayed
communications". Random numbers come from counters, so that a packet's fate depends on the seed and its seq alone, and
with bursts on whether the packet before it was lost.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Prediction

LINK_STREAM = 40
"""The link's stream of random numbers: default_rng([seed, LINK_STREAM, seq])."""

_STAMP, _SEQ, _SPACING, _VALID = (Prediction.get_fields().index(name) for name in ("stamp", "seq", "spacing", "valid"))


@dataclass(frozen=True)
class LossyLink:
    """A line with the given faults; without arguments it is perfect.

    ``drop``: long-run fraction of packets lost. ``delay`` [s]: of every packet. ``jitter`` [s]: each packet is late by
    up to this much more, uniformly. ``burst``: mean number of packets lost in a row (the two-state Markov chain of
    Gilbert 1960); independent losses come in rows of 1 / (1 - drop) on average, and a smaller number means just these.
    ``seed``: of the random numbers, a whole number >= 0.

    Raises DrakeTrackerError when a number is out of range.
    """

    drop: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    burst: float = 1.0
    seed: int = 0

    def __post_init__(self):
        for name, allowed, ok in (
            ("drop", "0 to 1", 0.0 <= self.drop <= 1.0),
            ("delay", "0 s or more", 0.0 <= self.delay < math.inf),
            ("jitter", "0 s or more", 0.0 <= self.jitter < math.inf),
            ("burst", "1 packet or more", 1.0 <= self.burst < math.inf),
            ("seed", "a whole number from 0", self.seed >= 0),
        ):
            if not ok:
                raise DrakeTrackerError(f"link {name} is {getattr(self, name)}; allowed: {allowed}")

    def post(self, state, packet, now):
        """Returns the `LinkState` after ``packet``, a `Prediction` vector, is offered to the line at ``now`` [s].

        A packet is not sent that is not valid, whose stamp was the last one offered, which is stamped after ``now`` (it
        was made for another run of the arm's clock), or which cannot be read (anything not finite, no spacing).
        """
        stamp = packet[_STAMP]
        if not packet[_VALID] or stamp == state.last_stamp or stamp > now or not _is_sound(packet):
            return state
        loss_draw, jitter_draw = self._draw(int(packet[_SEQ]))
        lost = bool(loss_draw < self._loss_probability(state))
        in_flight = _prune(state.in_flight, now)
        if not lost:
            packet = np.array(packet, dtype=float)
            packet.flags.writeable = False
            in_flight += ((now + self.delay + self.jitter * jitter_draw, packet),)
        return LinkState(in_flight=in_flight, last_stamp=float(stamp), last_lost=lost)

    def _draw(self, seq):
        if self.drop == 0.0 and self.jitter == 0.0:
            return 0.0, 0.0  # nothing is lost or late: the draws, which take longer than all the rest, decide nothing
        return np.random.default_rng([self.seed, LINK_STREAM, seq]).random(2)

    def _loss_probability(self, state):
        if state.last_stamp is None or self.drop == 1.0:
            return self.drop
        again = max(self.drop, 1.0 - 1.0 / self.burst)
        # The first loss of a row must be this rare for a fraction ``drop`` to be lost in the long run.
        return again if state.last_lost else self.drop * (1.0 - again) / (1.0 - self.drop)


@dataclass(frozen=True)
class LinkState:
    """Memory of the line: ``in_flight``, a tuple of (time of arrival [s], read-only packet) in the order of sending,
    and the stamp [s] and the fate of the packet offered last (None and False before the first)."""

    in_flight: tuple = ()
    last_stamp: float | None = None
    last_lost: bool = False

    def __deepcopy__(self, memo):
        return self  # nothing in it can change


def newest_arrived(state, now):
    """Returns the packet with the newest stamp that has arrived by ``now`` [s], None when there is none.

    A packet overtaken by a newer one never replaces it. The stamp tells, since a host that was started again counts its
    packets from 1.
    """
    arrived = (packet for arrival, packet in state.in_flight if arrival <= now)
    return max(arrived, key=lambda packet: packet[_STAMP], default=None)


def _is_sound(packet):
    """Whether the arm can read a packet, which may be that of somebody else's host."""
    return bool(np.isfinite(packet).all()) and packet[_SPACING] > 0.0 and packet[_SEQ] >= 0.0


def _prune(in_flight, now):
    """Forgets every packet that a newer one, already here, has made useless."""
    newest = newest_arrived(LinkState(in_flight), now)
    return in_flight if newest is None else tuple(item for item in in_flight if item[1][_STAMP] >= newest[_STAMP])
