"""Shows how a run is getting on: simulated time, phase, real-time factor."""

import sys
import time

_TERMINAL_INTERVAL = 0.2
_PLAIN_INTERVAL = 10.0


class Progress:
    """A callable ``progress(sim_time, phase)`` that rewrites one line on a terminal, and elsewhere prints one now and
    then.

    Args:
        duration: simulated time at which the run ends at the latest [s].
        stream: where to print.
        clock: returns the wall time [s].
    """

    def __init__(self, duration, stream=None, clock=time.monotonic):
        self._duration = duration
        self._stream = stream or sys.stderr
        self._clock = clock
        self._terminal = self._stream.isatty()
        self._first = self._last = None

    def __call__(self, sim_time, phase):
        """Takes the simulated time [s] and the name of the phase; prints unless it did so a moment ago."""
        now = self._clock()
        if self._first is None:
            self._first = (now, sim_time)
            self._last = now if not self._terminal else now - _TERMINAL_INTERVAL
        if now - self._last < (_TERMINAL_INTERVAL if self._terminal else _PLAIN_INTERVAL):
            return
        self._last = now
        wall = now - self._first[0]
        rate = f"{(sim_time - self._first[1]) / wall:.2f}x real time" if wall > 0.0 else ""
        line = f"{sim_time:6.1f} s of {self._duration:g}  {phase:<10}  {rate}"
        self._stream.write(f"\r{line}\x1b[K" if self._terminal else line.rstrip() + "\n")
        self._stream.flush()

    def close(self):
        """Clears the line on a terminal."""
        if self._terminal and self._first is not None:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
