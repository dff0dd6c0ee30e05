"""What happened in a run, read from its log: phases, the train's true path, and how far from it each estimate was.

Errors are horizontal, at the centre of the train's body, and split along and across its true direction of travel.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from drake_tracker.core.messages import KNOT_COUNT, KNOT_FIELDS, PREDICTION_HEADER
from drake_tracker.core.timing import GRASP_SLOT, TIME_STEP
from drake_tracker.grasp.schema import PROGRAMS, Phase

_X, _Y, _YAW = (KNOT_FIELDS.index(field) for field in ("x", "y", "yaw"))


class PhaseSpan(NamedTuple):
    """A stretch of a run: phase, and its start and end [s]."""

    phase: IntEnum
    start: float
    end: float


def phase_spans(log, time_step=TIME_STEP, phases=Phase):
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


def during(spans, times, *phases):
    """Returns which of ``times`` (n,) [s] lie in one of the ``phases``, shape (n,), bool."""
    times = np.asarray(times, dtype=float)
    inside = np.zeros(times.shape, bool)
    for span in spans:
        if span.phase in phases:
            inside |= (times >= span.start) & (times <= span.end)
    return inside


def sighted(spans, times):
    """Returns at which of ``times`` (n,) [s] the arm used vision, shape (n,), bool."""
    return during(spans, times, *(phase for phase in Phase if not PROGRAMS[phase].frozen))


def train_pose(log, times):
    """Returns the train's true (x, y, z, yaw) [m, rad] at ``times`` (n,) [s], shape (n, 4), NaN where nothing is
    logged.

    Linear between samples: at 0.2 m/s on a radius of 0.12 m that is right to 12 micrometres. The yaw is continuous.
    """
    truth = log["truth_train_state"]
    times = np.asarray(times, dtype=float)
    if len(truth.times) == 0:
        return np.full((len(times), 4), np.nan)
    qw, qx, qy, qz = truth.view("qw", "qx", "qy", "qz").T
    yaw = np.unwrap(np.arctan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2))
    rows = np.column_stack([truth.view("x", "y", "z"), yaw])
    return _interpolate(times, truth.times, rows)


def tool_pose(log, times):
    """Returns the tool's true (x, y, z, yaw) [m, rad] at ``times`` (n,) [s], shape (n, 4), NaN where nothing is
    logged.
    """
    tool = log["tool"]
    rows = np.column_stack([tool.view("x", "y", "z"), np.unwrap(tool["yaw"])])
    return _interpolate(np.asarray(times, dtype=float), tool.times, rows)


def errors(log, times, xy):
    """Returns how far the points ``xy`` (n, 2) [m] lie from the train at ``times`` (n,) [s]: (along, across), shape (n,
    2).

    Positive is ahead of the train, and to its left. NaN where the truth is not logged.
    """
    truth = train_pose(log, times)
    dx, dy = (np.asarray(xy, dtype=float) - truth[:, :2]).T
    cos, sin = np.cos(truth[:, 3]), np.sin(truth[:, 3])
    return np.column_stack([cos * dx + sin * dy, cos * dy - sin * dx])


class Predictions(NamedTuple):
    """Packets, each read at one instant: times (n,) [s], xy (n, 2) [m], yaw (n,) [rad], stamps (n,) [s]."""

    times: np.ndarray
    xy: np.ndarray
    yaw: np.ndarray
    stamps: np.ndarray


def fresh_packets(signal):
    """Returns the indices of the samples of a logged packet signal at which a new packet shows."""
    seq = signal["seq"]
    return np.nonzero((signal["valid"] > 0) & (np.diff(seq, prepend=0.0) != 0))[0]


def predictions_ahead(signal, horizon):
    """Returns what each packet of a logged packet signal says of the time ``horizon`` [s] after its stamp."""
    index = fresh_packets(signal)
    return _evaluate(signal, index, signal["stamp"][index] + horizon)


def predictions_of_now(signal):
    """Returns what the packet in force at each sample of a logged packet signal says of that very time."""
    index = np.nonzero(signal["valid"] > 0)[0]
    return _evaluate(signal, index, signal.times[index])


def _evaluate(signal, index, times):
    knots = signal.data[index, PREDICTION_HEADER:].reshape(-1, KNOT_COUNT, len(KNOT_FIELDS))
    position = (times - signal["first_time"][index]) / signal["spacing"][index]
    before = np.clip(np.floor(position), 0, KNOT_COUNT - 2).astype(int)
    weight = (position - before)[:, None]
    row = np.arange(len(index))
    knot = (1.0 - weight) * knots[row, before] + weight * knots[row, before + 1]
    return Predictions(times, knot[:, [_X, _Y]], knot[:, _YAW], signal["stamp"][index])


def _interpolate(times, known_times, rows):
    if len(known_times) == 0:
        return np.full((len(times), rows.shape[1]), np.nan)
    return np.column_stack([np.interp(times, known_times, row, left=np.nan, right=np.nan) for row in rows.T])
