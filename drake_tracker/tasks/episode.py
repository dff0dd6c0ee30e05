"""What happened in a run, read from its log: phases, the train's true path, and how far from it each estimate was.

Errors are horizontal, at the centre of the train's body, and split along and across its true direction of travel.
"""

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import KNOT_COUNT, KNOT_FIELDS, PREDICTION_HEADER
from drake_tracker.core.timing import GRASP_SLOT, TIME_STEP

_X, _Y, _YAW = (KNOT_FIELDS.index(field) for field in ("x", "y", "yaw"))


Log = Mapping[str, Signal]
"""{name: Signal} of a run."""


class PhaseSpan(NamedTuple):
    """A stretch of a run: phase, and its start and end [s]."""

    phase: IntEnum
    start: float
    end: float


def phase_spans(
    log: Mapping[str, Signal], phases: type[IntEnum], time_step: float = TIME_STEP
) -> tuple[PhaseSpan, ...]:
    """Returns the tuple of `PhaseSpan` of a run, in order; ``phases`` is the task's enumeration of them.

    The log shows a command at the end of the servo period in whose last plant step it was given; starts are put back to
    that instant.
    """
    command = log["command"]
    if len(command.times) == 0:
        return ()
    numbers = command["phase"].astype(int)
    first = np.concatenate([[0], np.nonzero(np.diff(numbers))[0] + 1])
    starts = np.maximum(command.times[first] - (1.0 - GRASP_SLOT) * time_step, 0.0)
    ends = np.append(starts[1:], command.times[-1])
    return tuple(PhaseSpan(phases(numbers[k]), float(a), float(b)) for k, a, b in zip(first, starts, ends))


def during(spans: Sequence[PhaseSpan], times: np.ndarray | Sequence[float], *phases: IntEnum) -> np.ndarray:
    """Returns which of ``times`` (n,) [s] lie in one of the ``phases``, shape (n,), bool."""
    times = np.asarray(times, dtype=float)
    inside = np.zeros(times.shape, bool)
    for span in spans:
        if span.phase in phases:
            inside |= (times >= span.start) & (times <= span.end)
    return inside


def tool_pose(log: Mapping[str, Signal], times: np.ndarray | Sequence[float]) -> np.ndarray:
    """Returns the tool's true (x, y, z, yaw) [m, rad] at ``times`` (n,) [s], shape (n, 4), NaN where nothing is
    logged.
    """
    tool = log["tool"]
    rows = np.column_stack([tool.view("x", "y", "z"), np.unwrap(tool["yaw"])])
    return interpolate_rows(np.asarray(times, dtype=float), tool.times, rows)


class Predictions(NamedTuple):
    """Packets, each read at one instant: times (n,) [s], xy (n, 2) [m], yaw (n,) [rad], stamps (n,) [s]."""

    times: np.ndarray
    xy: np.ndarray
    yaw: np.ndarray
    stamps: np.ndarray


def fresh_packets(signal: Signal) -> np.ndarray:
    """Returns the indices of the samples of a logged packet signal at which a new packet shows."""
    seq = signal["seq"]
    return np.nonzero((signal["valid"] > 0) & (np.diff(seq, prepend=0.0) != 0))[0]


def predictions_ahead(signal: Signal, horizon: float) -> Predictions:
    """Returns what each packet of a logged packet signal says of the time ``horizon`` [s] after its stamp."""
    index = fresh_packets(signal)
    return _evaluate(signal, index, signal["stamp"][index] + horizon)


def predictions_of_now(signal: Signal) -> Predictions:
    """Returns what the packet in force at each sample of a logged packet signal says of that very time."""
    index = np.nonzero(signal["valid"] > 0)[0]
    return _evaluate(signal, index, signal.times[index])


def _evaluate(signal: Signal, index: np.ndarray, times: np.ndarray) -> Predictions:
    knots = signal.data[index, PREDICTION_HEADER:].reshape(-1, KNOT_COUNT, len(KNOT_FIELDS))
    position = (times - signal["first_time"][index]) / signal["spacing"][index]
    before = np.clip(np.floor(position), 0, KNOT_COUNT - 2).astype(int)
    weight = (position - before)[:, None]
    row = np.arange(len(index))
    knot = (1.0 - weight) * knots[row, before] + weight * knots[row, before + 1]
    return Predictions(times, knot[:, [_X, _Y]], knot[:, _YAW], signal["stamp"][index])


def interpolate_rows(times: np.ndarray, known_times: np.ndarray, rows: np.ndarray) -> np.ndarray:
    if len(known_times) == 0:
        return np.full((len(times), rows.shape[1]), np.nan)
    return np.column_stack([np.interp(times, known_times, row, left=np.nan, right=np.nan) for row in rows.T])
