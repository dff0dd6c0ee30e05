"""What the page asks of a run: pause, resume, a single step, a rate. The simulation's own thread acts on it."""

import math
import threading
import time

RATES = (0.1, 0.25, 0.5, 1.0)
"""Simulated seconds in a second that may be asked for; None is as fast as it goes."""
_LOOK = 0.1
"""Longest wait [s] between two looks whether the run was interrupted."""
_LATE = 0.1
"""Lag [s] behind the wanted rate that is given up instead of being made good."""


class Control:
    """Holds a run back. Everything but `hold` may be called from any thread.

    Args:
      clock: returns the wall time [s].
    """

    def __init__(self, clock=time.monotonic):
        self._clock = clock
        self._changed = threading.Condition()
        self._paused, self._steps, self._rate = False, 0, None
        self._anchor = None
        self.held = 0.0
        """Wall time [s] for which the run was held."""

    @property
    def paused(self):
        """Whether the run stands still, but for single steps."""
        return self._paused

    @property
    def rate(self):
        """Simulated seconds in a second, at most; None is as fast as it goes."""
        return self._rate

    def pause(self):
        """Holds the run after the cycle it is in."""
        self._change(paused=True)

    def resume(self):
        """Lets the run go on."""
        self._change(paused=False)

    def step(self):
        """Lets the run go on for one cycle, and holds it then."""
        self._change(paused=True, steps=1)

    def set_rate(self, rate):
        """Asks for one of the `RATES`, or None. Raises ValueError on another."""
        if rate is not None and (isinstance(rate, bool) or rate not in RATES):
            raise ValueError(f"rate must be null or one of {', '.join(map(str, RATES))}")
        with self._changed:
            self._rate, self._anchor = rate, None
            self._changed.notify()

    def hold(self, now, interrupted=lambda: False, idle=lambda: None):
        """Returns when the run may go on from the simulated time ``now`` [s], or was ``interrupted``.

        ``idle`` is called from time to time while the run is held. To be called once in each cycle.
        """
        start = self._clock()
        with self._changed:
            while not interrupted():
                if not self._paused:
                    wait = self._too_early(now)
                elif self._steps:
                    self._steps -= 1
                    self._anchor = None
                    break
                else:
                    wait, self._anchor = math.inf, None
                if wait <= 0.0:
                    break
                idle()
                self._changed.wait(min(wait, _LOOK))
        self.held += self._clock() - start

    def _too_early(self, now):
        """Returns by how much [s] the run is ahead of its rate."""
        if self._rate is None:
            return 0.0
        wall = self._clock()
        if self._anchor is None:
            self._anchor = (wall, now)
        since, first = self._anchor
        early = since + (now - first) / self._rate - wall
        if early < -_LATE:
            self._anchor = (wall, now)
        return early

    def _change(self, paused, steps=0):
        with self._changed:
            self._paused = paused
            self._steps = self._steps + steps if paused else 0
            self._changed.notify()
