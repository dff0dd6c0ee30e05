"""Keeps the camera images around the last closing of the hand, for a picture that is drawn after the run."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State
from pydrake.systems.primitives import VectorLogSink
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import ArmCommand, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, inputs
from drake_tracker.run.log_recorder import read_log, tool_signal
from drake_tracker.tasks.filming import Closeup, Frame, port_of
from drake_tracker.tasks.task import Task

EVERY = 2
"""Cycles between two frames that are kept."""
_ROUNDING = 1e-6
"""Allowance for rounding errors of times [cycles]."""


@dataclass(frozen=True, eq=False)
class _Kept(FrozenState):
    """The frames that are remembered.

    Attributes:
        recent: the frames of the last time, oldest first.
        closing: whether the hand closes.
        began: time at which the last closing began whose frames are still being taken [s], or None.
        closed: the frames of the last closing, oldest first.
    """

    recent: tuple[Frame, ...] = ()
    closing: bool = False
    began: float | None = None
    closed: tuple[Frame, ...] = ()


class CloseupSystem(LeafSystem):
    """Keeps the images around the last closing of the hand.

    .. pydrake_system::

        name: CloseupSystem
        input_ports:
        - camera_left
        - camera_right
        - command

    These are the ports for two cameras. A single camera has ``camera``.

    - ``camera_*``: ImageRgba8U, the newest image.
    - ``command``: an `ArmCommand`. All zeros is its first phase.

    An unrestricted update in every vision cycle, with offset 0, looks for the beginning of the phase and, in every
    `EVERY`-th cycle, keeps the images. The vision reads the cameras at the same instants, so that no image is rendered
    twice. Images older than ``before + after`` are dropped. The images of the last closing are kept until the next
    closing.

    Args:
        closeup: which images are kept.
    """

    def __init__(self, closeup: Closeup) -> None:
        super().__init__()
        self._closeup = closeup
        self._latency = closeup.image_latency
        self._images = {
            side: self.DeclareAbstractInputPort(port_of("camera", side), AbstractValue.Make(ImageRgba8U()))
            for side in closeup.sides
        }
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._kept = self.DeclareAbstractState(AbstractValue.Make(_Kept()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(VISION_PERIOD, 0.0, self._update)

    def frames(self, root_context: Context) -> tuple[Frame, ...]:
        """Returns the frames around the last closing in the order of time, none if the hand never closed.

        Args:
            root_context: of the whole diagram, at the end; it is not changed.
        """
        kept = self.GetMyContextFromRoot(root_context).get_abstract_state(self._kept).get_value()
        if kept.began is None:
            return kept.closed
        until = kept.began + self._closeup.after
        return (*kept.recent, *self._rest(root_context, kept.recent, until)) if self._latency > 0 else kept.recent

    def _rest(self, root_context: Context, recent: tuple[Frame, ...], until: float) -> list[Frame]:
        """Returns the frames up to a time [s] that were captured before the end but have not appeared."""
        later = root_context.Clone()
        context = self.GetMyContextFromRoot(later)
        newest = round(recent[-1].time / VISION_PERIOD) if recent else -EVERY
        captured = math.ceil(root_context.get_time() / VISION_PERIOD - _ROUNDING)
        frames = []
        for cycle in range(newest + EVERY, captured, EVERY):
            if cycle * VISION_PERIOD <= until:
                later.SetTime((cycle + self._latency) * VISION_PERIOD)
                frames.append(self._frame(context, cycle))
        return frames

    def _update(self, context: Context, state: State) -> None:
        kept = context.get_abstract_state(self._kept).get_value()
        now, closeup = context.get_time(), self._closeup
        closing = bool(ArmCommand(self._command.Eval(context)).phase == closeup.phase)
        new = replace(kept, closing=closing, began=now if closing and not kept.closing else kept.began)
        cycle = round(now / VISION_PERIOD) - self._latency
        if cycle >= 0 and cycle % EVERY == 0:
            frame = self._frame(context, cycle)
            oldest = frame.time - closeup.before - closeup.after
            new = replace(new, recent=(*(each for each in new.recent if each.time >= oldest), frame))
            if new.began is not None and frame.time >= new.began + closeup.after:
                new = replace(new, began=None, closed=new.recent)
        state.get_mutable_abstract_state(self._kept).set_value(new)

    def _frame(self, context: Context, cycle: int) -> Frame:
        images = {
            side: read_only(cv2.cvtColor(port.Eval(context).data, cv2.COLOR_RGBA2BGR))
            for side, port in self._images.items()
        }
        return Frame(cycle * VISION_PERIOD, images)


class CloseupRecorder:
    """A `Recorder` that draws the picture of the grasp.

    Args:
        system: the System that keeps the images.
        loggers: the return value of `add_loggers`.
        task: task whose signals are logged.
        hand_eye: diagram of the run.
        closeup: how to draw the picture.
        path: PNG file to write.
    """

    def __init__(
        self,
        system: CloseupSystem,
        loggers: Mapping[str, VectorLogSink],
        task: Task,
        hand_eye: HandEyeDiagram,
        closeup: Closeup,
        path: Path,
    ) -> None:
        self._system, self._loggers, self._task, self._hand_eye = system, loggers, task, hand_eye
        self._closeup, self._path = closeup, path

    def finish(self, root_context: Context) -> None:
        """Draws the picture. Writes no file if the hand never closed."""
        frames = self._system.frames(root_context)
        if frames:
            log = read_log(self._loggers, root_context, self._task)
            log["tool"] = tool_signal(log["arm_state"], self._hand_eye.arm.model)
            self._closeup.draw(frames, log, self._path)


def add_closeup(
    builder: DiagramBuilder,
    *,
    hand_eye: HandEyeDiagram,
    loggers: Mapping[str, VectorLogSink],
    task: Task,
    closeup: Closeup,
    folder: Path,
) -> CloseupRecorder:
    """Adds a `CloseupSystem` to the builder of a `HandEyeDiagram`.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram whose images are kept.
        loggers: the return value of `add_loggers`.
        task: task whose signals are logged.
        closeup: which images are kept, and how to draw them.
        folder: run directory.

    Returns the recorder.
    """
    system = builder.AddNamedSystem("closeup", CloseupSystem(closeup))
    for port in inputs(system):
        builder.Connect(hand_eye.GetOutputPort(port.get_name()), port)
    return CloseupRecorder(system, loggers, task, hand_eye, closeup, folder / closeup.file)
