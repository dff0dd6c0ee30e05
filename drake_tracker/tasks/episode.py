"""The events of a run of any task, according to its log: phases, poses of the tool, and predictions."""

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import KNOT_COUNT, KNOT_FIELDS, KNOT_SPACING, PREDICTION_HEADER
from drake_tracker.core.timing import GRASP_SLOT, TIME_STEP

_X, _Y, _YAW = (KNOT_FIELDS.index(field) for field in ("x", "y", "yaw"))
_LARGEST = 1e12
"""Numbers in a packet that are larger make no sense in any unit, and would overflow."""

Log = Mapping[str, Signal]
"""{name: Signal} of a run."""


class PhaseSpan(NamedTuple):
    """A phase of a run.

    Attributes:
        phase: the phase.
        start: time at which it began [s].
        end: time at which it ended [s].
    """

    phase: IntEnum
    start: float
    end: float


def phase_spans(
    log: Mapping[str, Signal], phases: type[IntEnum], time_step: float = TIME_STEP
) -> tuple[PhaseSpan, ...]:
    """Returns the phases of a run, in order.

    A command is given in the last plant step of a servo period and appears in the log at the end of that period. The
    starts are corrected to the instant at which the command was given.

    Args:
        log: {name: Signal} of the run.
        phases: the task's enumeration of phases.
        time_step: the plant's step [s].
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
    """Returns at which times the run was in one of the given phases, shape (n,), bool.

    Args:
        spans: phases of the run.
        times: times [s], shape (n,).
        *phases: the phases to look for.
    """
    times = np.asarray(times, dtype=float)
    inside = np.zeros(times.shape, bool)
    for span in spans:
        if span.phase in phases:
            inside |= (times >= span.start) & (times <= span.end)
    return inside


def tool_pose(log: Mapping[str, Signal], times: np.ndarray | Sequence[float]) -> np.ndarray:
    """Returns the true pose (x, y, z, yaw) of the tool in W [m, rad], shape (n, 4), NaN where nothing is logged.

    Args:
        log: {name: Signal} of the run.
        times: times [s], shape (n,).
    """
    tool = log["tool"]
    rows = np.column_stack([tool.view("x", "y", "z"), np.unwrap(tool["yaw"])])
    return interpolate_rows(np.asarray(times, dtype=float), tool.times, rows)


class Predictions(NamedTuple):
    """Predictions of packets, each evaluated at one time.

    Attributes:
        times: times for which the packets predict [s], shape (n,).
        xy: predicted positions in W [m], shape (n, 2).
        yaw: predicted yaws [rad], shape (n,).
        stamps: stamps of the packets [s], shape (n,).
    """

    times: np.ndarray
    xy: np.ndarray
    yaw: np.ndarray
    stamps: np.ndarray


def fresh_packets(signal: Signal) -> np.ndarray:
    """Returns the indices of the samples of a logged packet signal at which a new packet appears, shape (n,).

    Packets that cannot be evaluated are left out.
    """
    seq = signal["seq"]
    with np.errstate(invalid="ignore"):
        return np.nonzero(can_be_evaluated(signal) & (np.diff(seq, prepend=0.0) != 0))[0]


def can_be_evaluated(signal: Signal) -> np.ndarray:
    """Returns which samples of a logged packet signal have a path that can be evaluated, shape (n,), bool.

    A host that is not ours may send anything; the arm rejects it, but the log keeps it.
    """
    sane = np.isfinite(signal.data).all(axis=1) & (np.abs(signal.data) < _LARGEST).all(axis=1)
    return sane & (signal["valid"] > 0) & (signal["spacing"] > 0.5 * KNOT_SPACING)


def predictions_ahead(signal: Signal, horizon: float) -> Predictions:
    """Returns the prediction of each packet for a fixed time after its stamp.

    Args:
        signal: logged packets.
        horizon: time after the stamp [s].
    """
    index = fresh_packets(signal)
    return _evaluate(signal, index, signal["stamp"][index] + horizon)


def predictions_of_now(signal: Signal) -> Predictions:
    """Returns, for each sample of a logged packet signal, the packet's prediction for the time of the sample."""
    index = np.nonzero(can_be_evaluated(signal))[0]
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
    """Returns rows interpolated linearly in time, shape (n, k), NaN outside of the known times.

    Args:
        times: times for which to interpolate [s], shape (n,).
        known_times: times of the rows [s], shape (m,).
        rows: known values, shape (m, k).
    """
    if len(known_times) == 0:
        return np.full((len(times), rows.shape[1]), np.nan)
    return np.column_stack([np.interp(times, known_times, row, left=np.nan, right=np.nan) for row in rows.T])
