"""The monitor of a simulation: reports progress, updates the live view, and ends the run."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from pydrake.systems.framework import Context, Diagram, EventStatus

from drake_tracker.arm.safety.packet_guard import REASONS, Rejection
from drake_tracker.core.messages import ArmCommand, PacketReport
from drake_tracker.core.processes import signals
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, has_tracks
from drake_tracker.tasks.task import Task
from drake_tracker.tasks.tracks import TRACKS, reason_words

AFTERGLOW = 0.5
"""Simulated time for which a run continues after the object was grasped or lost, so that log and video show it [s]."""
WATCH_PERIOD = 1 / 60
"""Simulated time between two evaluations of the verdict, and a single step of the live view: one vision cycle [s]."""
_ROUNDING = 1e-9
"""Allowance for rounding errors of times [s]."""

Progress = Callable[[float, str], object]
"""Called with (simulated time [s], what the arm does: the phase and, after a colon, what it waits for)."""


class Onlooker(Protocol):
    """The part of a live view that the monitor uses."""

    def look(self, now: float, phase: int, p_success: float | None, interrupted: Callable[[], bool]) -> None:
        """Updates the view once per vision cycle. It may pause the run.

        Args:
            now: simulated time [s].
            phase: number of the phase.
            p_success: probability that a grasp would succeed, None while the task does not estimate it.
            interrupted: returns whether the run was interrupted, which must end a pause.
        """
        ...


class RunMonitor:
    """A monitor for `Simulator.set_monitor`. It reads output ports and changes nothing itself.

    The monitor runs between two steps. A world that must change its Context between two steps, once per vision cycle,
    has a method ``between_steps``; the monitor calls it with the Context of the whole diagram, see
    `ConveyorWorldDiagram.between_steps`.

    Args:
        task: task of the run.
        hand_eye: diagram to monitor.
        progress: a `Progress`, or None.
        stop_when_over: whether the run ends when the object was grasped or is lost, according to the judge.
        onlooker: a live view, or None.
        keep: called with the Context of the whole diagram once per vision cycle, to record the run; or None.
        tell: called with each line of news for the user, or None.

    Attributes:
        interrupted: set it to True to end the run at the next step.
    """

    def __init__(
        self,
        task: Task,
        hand_eye: HandEyeDiagram,
        progress: Progress | None,
        stop_when_over: bool,
        onlooker: Onlooker | None = None,
        keep: Callable[[Context], object] | None = None,
        tell: Callable[[str], object] | None = None,
    ) -> None:
        self._task, self._hand_eye = task, hand_eye
        self._progress, self._stop, self._onlooker = progress, stop_when_over, onlooker
        self._keep = keep
        self._upkeep = getattr(hand_eye.world, "between_steps", None)
        self._news = PacketNews(hand_eye, tell) if tell is not None else None
        self._next_look = 0.0
        self._over_at: float | None = None
        self.interrupted = False

    def __call__(self, root_context: Context) -> EventStatus:
        now = root_context.get_time()
        if self.interrupted:
            return EventStatus.ReachedTermination(self._hand_eye, "interrupted")
        if now < self._next_look:
            return EventStatus.DidNothing()
        self._next_look = (round(now / WATCH_PERIOD) + 1) * WATCH_PERIOD - _ROUNDING
        if self._upkeep is not None:
            self._upkeep(root_context)
        if self._keep is not None:
            self._keep(root_context)
        context = self._hand_eye.GetMyContextFromRoot(root_context)
        phase = self._task.phases(int(ArmCommand(self._hand_eye.GetOutputPort("command").Eval(context)).phase))
        if self._progress is not None:
            self._progress(now, self._task.activity(phase, self._diagnosis(context), self._unseen(context)))
        if self._news is not None:
            self._news.look(context)
        if self._onlooker is not None:
            p_success = self._task.p_success(self._diagnosis(context))
            self._onlooker.look(now, int(phase), p_success, lambda: self.interrupted)
        over = self._task.ended(self._task.verdict(self._hand_eye.GetOutputPort("truth_verdict").Eval(context)))
        if self._over_at is None and over:
            self._over_at = now
        late = self._over_at is not None and now >= self._over_at + AFTERGLOW and phase not in self._task.beside
        if self._stop and late:
            return EventStatus.ReachedTermination(self._hand_eye, over or "the object was grasped or is lost")
        return EventStatus.DidNothing()

    def _diagnosis(self, context: Context) -> Any:
        return self._task.diagnosis(self._hand_eye.GetOutputPort("diagnosis").Eval(context))

    def _unseen(self, context: Context) -> str:
        """Returns the reason for a missing point of the target; "" with a point, or if vision gives no reason."""
        if not has_tracks(self._hand_eye):
            return ""
        return reason_words(self._hand_eye.GetOutputPort(TRACKS).Eval(context))


@contextmanager
def interrupts(monitor: RunMonitor) -> Iterator[None]:
    """Makes Ctrl-C end the run at its next step instead of raising KeyboardInterrupt, so that the recording is kept.

    SIGTERM and SIGHUP do the same where they raise KeyboardInterrupt, see `signals.graceful`. So does a signal that
    arrived before and was swallowed.
    """

    def interrupt(signum: int) -> None:
        monitor.interrupted = True

    monitor.interrupted |= signals.received() is not None
    with signals.on_signal(interrupt):
        yield


class PacketNews:
    """Watches the port ``packet_report`` of a diagram.

    Args:
        hand_eye: diagram to watch.
        tell: called with each line of news for the user.
    """

    def __init__(self, hand_eye: Diagram, tell: Callable[[str], object]) -> None:
        self._hand_eye, self._tell = hand_eye, tell
        self._told: set[Rejection] = set()

    def look(self, context: Context) -> None:
        """Tells the reasons that were not told before.

        Args:
            context: the diagram's Context.
        """
        report = PacketReport(self._hand_eye.GetOutputPort("packet_report").Eval(context))
        for reason, words in REASONS.items():
            if reason not in self._told and getattr(report, reason.name.lower()):
                self._told.add(reason)
                self._tell(f"arm: rejecting packets from {context.get_time():.2f} s on: {words}")
