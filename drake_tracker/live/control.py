"""Pause, resume, single steps and real-time rate of a run, as requested by the page of the live view."""

import math
import threading
import time
from collections.abc import Callable

RATES = (0.1, 0.25, 0.5, 1.0)
"""Real-time rates that may be requested (simulated seconds per second); None runs as fast as possible."""
_LOOK_PERIOD = 0.1
"""Longest wall time [s] between two checks whether the run was interrupted."""
_LATE = 0.1
"""Lag [s] behind the requested rate beyond which the run does not catch up."""


class Control:
    """Holds a run back. Every method but `hold` may be called from any thread.

    Attributes:
        held: wall time [s] for which the run was held so far.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Creates the control of a run that is not held.

        Args:
            clock: returns the wall time [s].
        """
        self._clock = clock
        self._changed = threading.Condition()
        self._paused, self._steps = False, 0
        self._rate: float | None = None
        self._anchor: tuple[float, float] | None = None
        self.held = 0.0

    @property
    def paused(self) -> bool:
        """Whether the run is paused; single steps are still possible."""
        return self._paused

    @property
    def rate(self) -> float | None:
        """Greatest real-time rate (simulated seconds per second); None is as fast as possible."""
        return self._rate

    def pause(self) -> None:
        """Pauses the run after the current cycle."""
        self._change(paused=True)

    def resume(self) -> None:
        """Resumes the run."""
        self._change(paused=False)

    def step(self) -> None:
        """Runs one cycle and pauses."""
        self._change(paused=True, steps=1)

    def set_rate(self, rate: float | None) -> None:
        """Limits the real-time rate.

        Args:
            rate: one of `RATES`, or None for as fast as possible. Raises ValueError for any other value.
        """
        if rate is not None and (isinstance(rate, bool) or rate not in RATES):
            raise ValueError(f"rate must be null or one of {', '.join(map(str, RATES))}")
        with self._changed:
            self._rate, self._anchor = rate, None
            self._changed.notify()

    def hold(
        self,
        now: float,
        interrupted: Callable[[], bool] = lambda: False,
        idle: Callable[[], object] = lambda: None,
    ) -> None:
        """Returns as soon as the run may continue; to be called once per cycle by the simulation's thread.

        Args:
            now: simulated time [s].
            interrupted: returns whether the run was interrupted; then the method returns at once.
            idle: called repeatedly while the run is held.
        """
        start = self._clock()
        with self._changed:
            while not interrupted():
                if not self._paused:
                    wait = self._time_ahead(now)
                elif self._steps:
                    self._steps -= 1
                    self._anchor = None
                    break
                else:
                    wait, self._anchor = math.inf, None
                if wait <= 0.0:
                    break
                idle()
                self._changed.wait(min(wait, _LOOK_PERIOD))
        self.held += self._clock() - start

    def _time_ahead(self, now: float) -> float:
        """Returns how far [s] the run is ahead of the requested rate."""
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

    def _change(self, paused: bool, steps: int = 0) -> None:
        with self._changed:
            self._paused = paused
            self._steps = self._steps + steps if paused else 0
            self._changed.notify()
