"""Puts messages that come one by one, some of them never, back into the sender's cycles."""

from dataclasses import dataclass

REORDERED = 6
"""Cycles by which a message may be late. One that is older shows that the sender's clock began anew."""
LONGEST_GAP = 600
"""Cycles without a message, 10 s, after which the sender's clock was set: nothing is to be gone on with."""


@dataclass(frozen=True)
class Cycle:
    """What was sent in one cycle.

    number: the sender's time over the period. messages: {channel: what came}, not every channel where one was lost.
    anew: whether the clock began, or began anew, with this cycle.
    """

    number: int
    messages: dict
    anew: bool


class CycleCollector:
    """Collects what belongs together. A cycle is complete, or is given up when a later one begins.

    Args:
      channels: those of which a cycle consists. period: of the cycles [s].
    """

    def __init__(self, channels, period):
        self._channels, self._period = frozenset(channels), period
        self._open = None
        self._last = None

    def put(self, channel, time, message):
        """Takes a message with its sender's time [s]. Returns the cycles that it ends, oldest first: none, one or two."""
        number = round(time / self._period)
        newest = self._last if self._open is None else self._open.number
        ended = []
        anew = newest is None or number < newest - REORDERED or number > newest + LONGEST_GAP
        if self._open is not None and (anew or number > self._open.number):
            ended.append(self._end())
        if not anew and (number < newest or number == self._last):
            return ended  # late, or sent twice
        if self._open is None:
            self._open = Cycle(number, {}, anew)
        self._open.messages[channel] = message
        if self._channels <= self._open.messages.keys():
            ended.append(self._end())
        return ended

    def _end(self):
        cycle, self._open = self._open, None
        self._last = cycle.number
        return cycle
