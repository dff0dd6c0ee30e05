"""Groups messages, which arrive one by one and may be lost, into the sender's cycles."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

REORDERED = 6
"""Cycles by which a message may be late. An older message means that the sender's clock has restarted."""
LONGEST_GAP = 600
"""Cycles without a message (10 s) after which the sender's clock counts as restarted."""


@dataclass(frozen=True)
class Cycle:
    """The messages that were sent in one cycle.

    Attributes:
        number: the sender's time divided by the period.
        messages: {channel: message}, without the channels whose message was lost.
        anew: whether the sender's clock started, or restarted, with this cycle.
    """

    number: int
    messages: dict[str, Any]
    anew: bool


class CycleCollector:
    """Collects the messages of one cycle. A cycle ends when it is complete, or when a later one begins.

    Args:
        channels: the channels of which a cycle consists.
        period: period of the cycles [s].
    """

    def __init__(self, channels: Collection[str], period: float) -> None:
        self._channels, self._period = frozenset(channels), period
        self._open: Cycle | None = None
        self._last: int | None = None

    def put(self, channel: str, time: float, message: Any) -> list[Cycle]:
        """Accepts a message. Returns the cycles that it ends, oldest first: none, one or two.

        Args:
            channel: the channel on which the message arrived.
            time: the sender's time [s].
            message: the message.
        """
        number = round(time / self._period)
        newest = self._last if self._open is None else self._open.number
        ended = []
        anew = newest is None or number < newest - REORDERED or number > newest + LONGEST_GAP
        if self._open is not None and (anew or number > self._open.number):
            ended.append(self._end(self._open))
        if not anew and ((newest is not None and number < newest) or number == self._last):
            return ended  # late, or sent twice
        if self._open is None:
            self._open = Cycle(number, {}, anew)
        self._open.messages[channel] = message
        if self._channels <= self._open.messages.keys():
            ended.append(self._end(self._open))
        return ended

    def _end(self, cycle: Cycle) -> Cycle:
        self._open = None
        self._last = cycle.number
        return cycle
