"""Shows how a run or a campaign is getting on."""

import sys
import time

_TERMINAL_INTERVAL = 0.2
_PLAIN_INTERVAL = 10.0
_BAR = 24


class _Line:
    """One line that is rewritten on a terminal; elsewhere a line printed now and then.

    Args:
        stream: where to print.
        clock: returns the wall time [s].
    """

    def __init__(self, stream=None, clock=time.monotonic):
        self._stream = stream or sys.stderr
        self._clock = clock
        self._terminal = self._stream.isatty()
        self._first = self._last = None

    def _start(self, now):
        self._first = now
        self._last = now if not self._terminal else now - _TERMINAL_INTERVAL

    def _is_due(self, now):
        return now - self._last >= (_TERMINAL_INTERVAL if self._terminal else _PLAIN_INTERVAL)

    def _show(self, line, now):
        self._last = now
        self._stream.write(f"\r{line}\x1b[K" if self._terminal else line.rstrip() + "\n")
        self._stream.flush()

    def say(self, line):
        """Prints a line of its own, which stays."""
        self._stream.write(f"\r\x1b[K{line}\n" if self._terminal else f"{line}\n")
        self._stream.flush()

    def close(self):
        """Clears the line on a terminal."""
        if self._terminal and self._first is not None:
            self._stream.write("\r\x1b[K")
            self._stream.flush()


class Progress(_Line):
    """A callable ``progress(sim_time, phase)``: simulated time, phase, real-time factor of a run.

    Args:
        duration: simulated time at which the run ends at the latest [s].
        stream: where to print.
        clock: returns the wall time [s].
    """

    def __init__(self, duration, stream=None, clock=time.monotonic):
        super().__init__(stream, clock)
        self._duration = duration
        self._first_time = 0.0

    def __call__(self, sim_time, phase):
        """Takes the simulated time [s] and the name of the phase; prints unless it did so a moment ago."""
        now = self._clock()
        if self._first is None:
            self._start(now)
            self._first_time = sim_time
        if not self._is_due(now):
            return
        wall = now - self._first
        rate = f"{(sim_time - self._first_time) / wall:.2f}x real time" if wall > 0.0 else ""
        self._show(f"{sim_time:6.1f} s of {self._duration:g}  {phase:<10}  {rate}", now)


class StepsProgress(_Line):
    """A callable ``progress(done, steps, what)``: how far a job of so many steps is.

    Args:
        stream: where to print.
        clock: returns the wall time [s].
    """

    def __call__(self, done, steps, what):
        """Takes how many steps are done, how many there are, and what is done in them."""
        now = self._clock()
        if self._first is None:
            self._start(now)
        if self._is_due(now):
            self._show(f"{what}: {done} of {steps}", now)


class TrialsProgress(_Line):
    """A callable ``progress(ended, trials, taken)``: a bar, the rate of success and the time left of a campaign.

    Args:
        stream: where to print.
        clock: returns the wall time [s].
    """

    def __init__(self, stream=None, clock=time.monotonic):
        super().__init__(stream, clock)
        self._first_ended = 0

    def __call__(self, ended, trials, taken):
        """Takes how many trials have ended, how many there are, and how many took the object; prints unless it did so
        a moment ago. The first call, before any trial, says where the campaign goes on.
        """
        now = self._clock()
        if self._first is None:
            self._start(now)
            self._first_ended = ended
        elif not self._is_due(now) and ended < trials:
            return
        filled = _BAR * ended // max(trials, 1)
        line = f"[{'#' * filled}{'.' * (_BAR - filled)}] {ended} of {trials}  taken {taken}"
        fresh, wall = ended - self._first_ended, now - self._first
        if fresh and wall > 0.0:
            line += f"  {60.0 * fresh / wall:.1f} a minute"
            if ended < trials:
                line += f"  {time_left(wall, fresh, trials - ended)} left"
        self._show(line, now)


def time_left(wall, done, missing):
    """Returns in words how long ``missing`` trials take, when ``done`` took ``wall`` [s]."""
    seconds = round(wall / done * missing)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
