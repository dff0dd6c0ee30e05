"""Records the vector signals of a run with Drake's loggers, and streams them to a file during the run."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_tracker.arm.arm_model import ArmModel, tool_yaw
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import unwritable
from drake_tracker.core.log import STREAM_FILE, LogStream, Signal
from drake_tracker.core.messages import OperatorCommand
from drake_tracker.core.timing import VISION_PERIOD, steps_in
from drake_tracker.tasks.task import BODY_STATE, Task

OPERATOR = "operator"
"""Name of the signal with the operator's commands, which only a run with the live view has."""
OBJECT_STATES = "truth_object_states"
"""Name of the signal with the true states of further objects; other worlds do not have it."""
STREAM_PERIOD = 1.0
"""Simulated time or wall time, whichever is over first, between two records of the stream [s]."""
_TOOL = ("x", "y", "z", "yaw")
_COPIES = 3
"""Greatest number of copies of the log in memory: the loggers', twice as large while it grows, and the saved one."""


def add_loggers(
    builder: DiagramBuilder, hand_eye: Diagram, task: Task, operator: OutputPort | None = None
) -> dict[str, VectorLogSink]:
    """Adds a logger for each signal of a task that a diagram has as an output port.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: a `HandEyeDiagram`, or another diagram with ports of these names.
        task: task whose signals are logged.
        operator: port with the operator's commands, or None when there is no operator.

    Returns {name of the signal: its logger}.
    """
    signals = {**task.signals(), **_body_signals(task)}
    ports = {name: hand_eye.GetOutputPort(name) for name in signals if hand_eye.HasOutputPort(name)}
    periods = {name: period for name, (period, _) in signals.items()}
    if operator is not None:
        ports[OPERATOR], periods[OPERATOR] = operator, VISION_PERIOD
    loggers = {}
    for name, port in ports.items():
        loggers[name] = LogVectorOutput(port, builder, publish_period=periods[name])
        loggers[name].set_name(f"log_{name}")
    return loggers


def require_memory(loggers: Mapping[str, VectorLogSink], task: Task, duration: float) -> None:
    """Checks that the log of a run fits into the memory of this machine.

    Args:
        loggers: the return value of `add_loggers`.
        task: task whose signals are logged.
        duration: of the run [s].

    Raises DrakeTrackerError with the longest run that fits.
    """
    periods = {name: period for name, (period, _) in {**task.signals(), **_body_signals(task)}.items()}
    numbers = ((log.get_input_port().size() + 1) / periods.get(name, VISION_PERIOD) for name, log in loggers.items())
    needed = 8.0 * _COPIES * sum(numbers) * duration
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > memory:
        raise DrakeTrackerError(
            f"duration: the log of {duration:g} s takes up to {1e-9 * needed:.1f} GB of memory, and this machine has "
            f"{1e-9 * memory:.1f} GB; at most {duration * memory / needed:.0f} s fit"
        )


def read_log(loggers: Mapping[str, VectorLogSink], root_context: Context, task: Task) -> dict[str, Signal]:
    """Returns {name: Signal} of everything logged so far.

    Args:
        loggers: the return value of `add_loggers`.
        root_context: Context of the whole diagram.
        task: task whose signals were logged.
    """
    fields = _fields(loggers, task)
    log = {}
    for name, logger in loggers.items():
        record = logger.FindLog(root_context)
        log[name] = Signal(record.sample_times().copy(), record.data().T.copy(), fields[name])
    return log


def tool_signal(arm_state: Signal, model: ArmModel) -> Signal:
    """Returns the pose of the tool over time by forward kinematics of the logged joints, at the vision period.

    Args:
        arm_state: logged joint positions [rad] and velocities [rad/s].
        model: the controller's model of the arm.

    Returns a signal with the fields x, y, z in W [m] and yaw [rad].
    """
    every = steps_in(VISION_PERIOD)
    return Signal(arm_state.times[::every], _tool_poses(arm_state.data[::every], model), _TOOL)


class LogStreamer:
    """Streams the log of a run to a file in the run directory, so that it is kept if the process is killed.

    It reads the loggers and changes nothing. The pose of the tool is part of the stream, see `tool_signal`.

    Args:
        folder: run directory.
        loggers: the return value of `add_loggers`.
        task: task whose signals are logged.
        model: the controller's model of the arm.
        clock: returns the wall time [s].

    Raises DrakeTrackerError when the file cannot be written; after that, nothing more is written.
    """

    def __init__(
        self,
        folder: Path,
        loggers: Mapping[str, VectorLogSink],
        task: Task,
        model: ArmModel,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._loggers, self._model, self._clock = loggers, model, clock
        self._counts = dict.fromkeys(loggers, 0)
        self._last = (0.0, clock())
        self._path = folder / STREAM_FILE
        try:
            self._stream = LogStream(self._path, {**_fields(loggers, task), "tool": _TOOL})
        except OSError as error:
            raise unwritable(self._path, error) from None

    def __call__(self, root_context: Context) -> None:
        """Appends the samples since the last record, once `STREAM_PERIOD` has passed.

        Args:
            root_context: Context of the whole diagram.
        """
        now = (root_context.get_time(), self._clock())
        if max(now[0] - self._last[0], now[1] - self._last[1]) >= STREAM_PERIOD:
            self._last = now
            self._append(root_context)

    def end(self, root_context: Context) -> None:
        """Appends the rest and closes the file. On a full disk the rest is missing."""
        with suppress(DrakeTrackerError):
            self._append(root_context)
        self._stream.close()

    def remove(self) -> None:
        """Closes and removes the file, when the log was saved as a whole."""
        self._stream.remove()

    def _append(self, root_context: Context) -> None:
        news = {}
        for name, logger in self._loggers.items():
            record, first = logger.FindLog(root_context), self._counts[name]
            news[name] = (record.sample_times()[first:], record.data()[:, first:].T)
            self._counts[name] = record.num_samples()
        times, states = news["arm_state"]
        every = steps_in(VISION_PERIOD)
        start = (len(times) - self._counts["arm_state"]) % every
        news["tool"] = (times[start::every], _tool_poses(states[start::every], self._model))
        try:
            self._stream.append(news)
        except OSError as error:
            raise unwritable(self._path, error) from None


def _fields(loggers: Mapping[str, VectorLogSink], task: Task) -> dict[str, tuple[str, ...]]:
    """Returns {name: names of the fields} of the signals that are logged."""
    joints = loggers["q_commanded"].get_input_port().size() if "q_commanded" in loggers else 6
    names = {name: tuple(fields) for name, (_, fields) in task.signals(joints).items()}
    names[OPERATOR] = OperatorCommand.get_fields()
    for name, (_, fields) in _body_signals(task).items():
        if name in loggers:
            count = loggers[name].get_input_port().size() // len(fields)
            names[name] = tuple(f"{field}_{number}" for number in range(count) for field in fields)
    return {name: names[name] for name in loggers}


def _body_signals(task: Task) -> dict[str, tuple[float, Sequence[str]]]:
    """Returns the signals with fields for each of several bodies, as `Task.body_signals`."""
    return {OBJECT_STATES: (VISION_PERIOD, BODY_STATE), **task.body_signals}


def _tool_poses(states: np.ndarray, model: ArmModel) -> np.ndarray:
    """Returns x, y, z in W [m] and yaw [rad] of the tool, shape (n, 4), for rows that begin with joint positions.

    The pose is NaN where a position is not finite, as in the last row of a run that Drake aborted.
    """
    rows = []
    for q in states[:, : model.num_joints]:
        if np.isfinite(q).all():
            X_WT = model.tool_pose(q)
            rows.append([*X_WT.translation(), tool_yaw(X_WT)])
        else:
            rows.append([np.nan] * 4)
    return np.array(rows).reshape(-1, 4)
