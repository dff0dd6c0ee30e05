"""The times of the frames of a video, repaired where a container has them wrong."""

from bisect import bisect_right
from collections.abc import Sequence


class FrameTimes:
    """Gives each decoded frame its time, as a whole number of the stream's ticks.

    A decoder delivers frames in the order in which they are shown. The time of a frame is its own where that is
    possible. Otherwise, and for all frames of a stream that has only decode times, it is the next of all times:
    a container such as AVI stamps frames in the order in which they are decoded, and with B-frames, which are decoded
    later than frames that are shown after them, these times would run backwards.

    Args:
        ticks: times of all packets, in the order of the file.
        reordered: whether frames are not decoded in the order in which they are shown.
    """

    def __init__(self, ticks: Sequence[int], reordered: bool) -> None:
        self.ticks = sorted(set(ticks))
        self._in_order = reordered and all(one < other for one, other in zip(ticks, ticks[1:]))
        self.restart()

    def restart(self) -> None:
        """Begins again with the first frame."""
        self._last: int | None = None

    def next(self, own: int | None) -> int:
        """Returns the time of the next frame.

        Args:
            own: its time according to the decoder; None where it has none.
        """
        last = self._last
        if self._in_order or own is None or (last is not None and own <= last):
            after = 0 if last is None else bisect_right(self.ticks, last)
            own = self.ticks[after] if after < len(self.ticks) else (self.ticks[-1] if last is None else last + 1)
        self._last = own
        return own
