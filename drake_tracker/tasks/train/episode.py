"""What happened in a run of the train, read from its log: phases, the train's true path, errors from it.

Errors are horizontal, at the centre of the train's body, and split along and across its true direction of travel.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.grasp.schema import PROGRAMS, Phase
from drake_tracker.tasks import episode
from drake_tracker.tasks.episode import PhaseSpan, during, interpolate_rows


def phase_spans(log: Mapping[str, Signal], time_step: float = TIME_STEP) -> tuple[PhaseSpan, ...]:
    """Returns the phases of a run of the train; see `tasks.episode.phase_spans`."""
    return episode.phase_spans(log, Phase, time_step)


def sighted(spans: Sequence[PhaseSpan], times: np.ndarray) -> np.ndarray:
    """Returns at which of ``times`` (n,) [s] the arm used vision, shape (n,), bool."""
    return during(spans, times, *(phase for phase in Phase if not PROGRAMS[phase].blind))


def train_pose(log: Mapping[str, Signal], times: np.ndarray | Sequence[float]) -> np.ndarray:
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
    return interpolate_rows(times, truth.times, rows)


def errors(log: Mapping[str, Signal], times: np.ndarray, xy: Any) -> np.ndarray:
    """Returns how far the points ``xy`` (n, 2) [m] lie from the train at ``times`` (n,) [s]: (along, across), shape (n,
    2).

    Positive is ahead of the train, and to its left. NaN where the truth is not logged.
    """
    truth = train_pose(log, times)
    dx, dy = (np.asarray(xy, dtype=float) - truth[:, :2]).T
    cos, sin = np.cos(truth[:, 3]), np.sin(truth[:, 3])
    return np.column_stack([cos * dx + sin * dy, cos * dy - sin * dx])
