"""Groups messages, which arrive one by one and may be lost, into the sender's cycles."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

REORDERED = 6
"""Cycles by which a message may be late or early. A message farther off needs others that agree with it."""
LONGEST_GAP = 600
"""Cycles without a message (10 s) after which the sender's clock counts as restarted."""
AGREEING = 3
"""Cycles, one after the other, that must agree before the clock jumps: a single wrong time changes nothing."""
LATEST_TIME = 1e10
"""Latest time of a sender [s]: clocks that count from 1970 reach it in 2286. Later ones are too coarse as a float."""


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

    A message whose time is far from that of the newest cycle is put aside. Once `AGREEING` cycles have come in a row
    that continue each other, without a message of the present clock between them, the collector accepts them: as the
    cycles after a gap, or as those of a clock that restarted. A message of the present clock discards what was put
    aside.

    Args:
        channels: the channels of which a cycle consists.
        period: period of the cycles [s].
    """

    def __init__(self, channels: Collection[str], period: float) -> None:
        self._channels, self._period = frozenset(channels), period
        self._open: Cycle | None = None
        self._last: int | None = None
        self._aside: list[tuple[str, int, Any]] = []

    def put(self, channel: str, time: float, message: Any) -> list[Cycle]:
        """Accepts a message. Returns the cycles that it ends, oldest first.

        Args:
            channel: the channel on which the message arrived.
            time: the sender's time [s], from 0 to `LATEST_TIME`.
            message: the message.
        """
        number = round(time / self._period)
        newest = self._newest
        if newest is None or abs(number - newest) <= REORDERED:
            self._aside = []
            return self._add(channel, number, message, newest is None)
        if self._aside and abs(number - self._aside[-1][1]) > REORDERED:
            self._aside = []
        if any(each[:2] == (channel, number) for each in self._aside):
            return []  # sent twice
        self._aside.append((channel, number, message))
        if len({each[1] for each in self._aside}) < AGREEING:
            return []
        agreed, self._aside = self._aside, []
        anew = not 0 < agreed[0][1] - newest <= LONGEST_GAP
        ended = []
        for k, each in enumerate(agreed):
            ended += self._add(*each, anew=anew and k == 0)
        return ended

    @property
    def _newest(self) -> int | None:
        return self._last if self._open is None else self._open.number

    def _add(self, channel: str, number: int, message: Any, anew: bool) -> list[Cycle]:
        """Adds a message to the open cycle, or opens one. Returns the cycles that it ends."""
        newest = self._newest
        ended = []
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
