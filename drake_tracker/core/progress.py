"""Shows the progress of a run, a job or a campaign on the terminal."""

import os
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TextIO

_TERMINAL_INTERVAL = 0.2
_PLAIN_INTERVAL = 10.0
_BAR = 24
_shown = True


def show_progress(shown: bool) -> None:
    """Says whether this process shows progress (``drake-tracker --quiet``). Results and warnings are shown anyway."""
    global _shown
    _shown = shown


class _Line:
    """One line that is rewritten on a terminal. Elsewhere, a new line is printed every ten seconds.

    Args:
        stream: where to print; standard error by default.
        clock: returns the wall time [s].
    """

    def __init__(self, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream or sys.stderr
        self._clock = clock
        self._terminal = self._stream.isatty()
        self._started = False
        self._first = self._last = 0.0

    def _start(self, now: float) -> None:
        self._started, self._first = True, now
        self._last = now if not self._terminal else now - _TERMINAL_INTERVAL

    def _is_due(self, now: float) -> bool:
        return now - self._last >= (_TERMINAL_INTERVAL if self._terminal else _PLAIN_INTERVAL)

    def _show(self, line: str, now: float) -> None:
        self._last = now
        self._print(f"\r{line}\x1b[K" if self._terminal else line.rstrip() + "\n")

    def say(self, line: str) -> None:
        """Prints a separate line, which stays."""
        self._print(f"\r\x1b[K{line}\n" if self._terminal else f"{line}\n")

    def close(self) -> None:
        """Clears the line on a terminal."""
        if self._terminal and self._started:
            self._print("\r\x1b[K")

    def _print(self, text: str) -> None:
        if _shown:
            with suppress(OSError):  # the terminal was closed: this must not end a run
                self._stream.write(text)
                self._stream.flush()


class Progress(_Line):
    """A callable ``progress(sim_time, activity)``: simulated time, real-time factor, and what the arm does in a run.

    Args:
        duration: simulated time after which the run ends at the latest [s].
        stream: where to print; standard error by default.
        clock: returns the wall time [s].
    """

    def __init__(
        self, duration: float, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(stream, clock)
        self._duration = duration
        self._first_time = 0.0

    def __call__(self, sim_time: float, activity: str) -> None:
        """Shows the progress, at most five times a second on a terminal and every ten seconds elsewhere.

        Args:
            sim_time: simulated time [s].
            activity: the phase and, after a colon, what the arm waits for.
        """
        now = self._clock()
        if not self._started:
            self._start(now)
            self._first_time = sim_time
        if not self._is_due(now):
            return
        wall, advanced = now - self._first, sim_time - self._first_time
        rate = f"{advanced / wall:.2f}x real time" if wall > 0.0 else ""
        if wall > 0.0 and advanced > 0.0:  # a run ends earlier when the object is grasped
            rate += f", at most {time_left(wall, advanced, self._duration - sim_time)} left"
        line = f"{sim_time:6.1f} s of {self._duration:g}  {rate:<38}  {activity}"
        if self._terminal:  # a line that wraps could not be rewritten
            line = line[: shutil.get_terminal_size().columns - 1]
        self._show(line, now)


class StepsProgress(_Line):
    """A callable ``progress(done, steps, what)``: number of steps of a job that are done.

    Args:
        stream: where to print; standard error by default.
        clock: returns the wall time [s].
    """

    def __call__(self, done: int, steps: int, what: str) -> None:
        """Shows the progress, at most five times a second on a terminal and every ten seconds elsewhere.

        Args:
            done: number of steps done so far.
            steps: total number of steps.
            what: what the steps do, for the user.
        """
        now = self._clock()
        if not self._started:
            self._start(now)
        if self._is_due(now):
            self._show(f"{what}: {done} of {steps}", now)


class TrialsProgress(_Line):
    """A callable ``progress(ended, trials, succeeded)``: bar, successes so far and remaining time of a campaign.

    Args:
        stream: where to print; standard error by default.
        clock: returns the wall time [s].
    """

    _first_ended = 0

    def __call__(self, ended: int, trials: int, succeeded: int) -> None:
        """Shows the progress, at most five times a second on a terminal and every ten seconds elsewhere.

        The first call, before any trial, sets the starting point from which the remaining time is estimated.

        Args:
            ended: number of trials that have ended.
            trials: total number of trials.
            succeeded: number of trials that succeeded.
        """
        now = self._clock()
        if not self._started:
            self._start(now)
            self._first_ended = ended
        elif not self._is_due(now) and ended < trials:
            return
        filled = _BAR * ended // max(trials, 1)
        line = f"[{'#' * filled}{'.' * (_BAR - filled)}] {ended} of {trials}  succeeded {succeeded}"
        fresh, wall = ended - self._first_ended, now - self._first
        if fresh and wall > 0.0:
            line += f"  {60.0 * fresh / wall:.1f} per minute"
            if ended < trials:
                line += f"  {time_left(wall, fresh, trials - ended)} left"
        self._show(line, now)


def coloured(text: str, good: bool, stream: TextIO) -> str:
    """Returns a text in green or red when a stream is a terminal and NO_COLOR is not set, else the text."""
    if os.environ.get("NO_COLOR") or not stream.isatty():
        return text
    return f"\x1b[{32 if good else 31}m{text}\x1b[0m"


def time_left(wall: float, done: float, missing: float) -> str:
    """Returns an estimate of the time that the rest of the work takes, in words.

    Args:
        wall: wall time of the work done so far [s].
        done: amount of work done so far.
        missing: amount of work that remains.
    """
    seconds = round(wall / done * missing)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
