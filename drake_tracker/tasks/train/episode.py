"""The events of a run of the train, according to its log: phases, the train's true path, and errors.

Errors are horizontal, at the centre of the train's body, and split into components along and across its true direction
of travel.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.grasp.train.schema import PROGRAMS, Phase
from drake_tracker.tasks import episode
from drake_tracker.tasks.episode import PhaseSpan, during, interpolate_rows
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.world.train.hill import held_on_track
from drake_tracker.world.train.plant import TRAIN_HEIGHT


def phase_spans(log: Mapping[str, Signal], time_step: float = TIME_STEP) -> tuple[PhaseSpan, ...]:
    """Returns the phases of a run of the train, in order.

    Args:
        log: {name: Signal} of the run.
        time_step: the plant's step [s].
    """
    return episode.phase_spans(log, Phase, time_step)


def sighted(spans: Sequence[PhaseSpan], times: np.ndarray) -> np.ndarray:
    """Returns at which times the arm used vision, shape (n,), bool.

    Args:
        spans: phases of the run.
        times: times [s], shape (n,).
    """
    return during(spans, times, *(phase for phase in Phase if not PROGRAMS[phase].blind))


def train_pose(log: Mapping[str, Signal], times: np.ndarray | Sequence[float]) -> np.ndarray:
    """Returns the true pose (x, y, z, yaw) of the train in W [m, rad], shape (n, 4), NaN where nothing is logged.

    The pose is interpolated linearly between samples, with an error of 12 micrometres at 0.2 m/s on a radius of 0.12 m.
    The yaw is continuous.

    Args:
        log: {name: Signal} of the run.
        times: times [s], shape (n,).
    """
    truth = log["truth_train_state"]
    times = np.asarray(times, dtype=float)
    if len(truth.times) == 0:
        return np.full((len(times), 4), np.nan)
    qw, qx, qy, qz = truth.view("qw", "qx", "qy", "qz").T
    yaw = np.unwrap(np.arctan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2))
    rows = np.column_stack([truth.view("x", "y", "z"), yaw])
    return interpolate_rows(times, truth.times, rows)


def train_places(setup: TrainSetup, log: Mapping[str, Signal], until: float) -> np.ndarray:
    """Returns the places (s, lateral) of the train on its track at all logged times up to ``until``, shape (n, 2) [m].

    Each is searched near the one before while the rail holds the train, as the rail itself does.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        until: time up to which the train is followed [s].
    """
    truth, (track, near), places = log["truth_train_state"], setup.placement, []
    times = truth.times[truth.times <= until]
    turns = setup.scenario.track.turns  # if not, the heading does not tell branches apart
    for state, (x, y, _, yaw) in zip(truth.data.tolist(), train_pose(log, times)):
        held = held_on_track(track, state, setup.scenario.table_height + TRAIN_HEIGHT, near, turns)
        near = held.place if held else math.nan
        places.append(track.locate(x, y, turns * math.cos(yaw), turns * math.sin(yaw), near)[:2])
    return np.array(places).reshape(-1, 2)


def errors(log: Mapping[str, Signal], times: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Returns the errors (along, across) of points relative to the train [m], shape (n, 2).

    Positive values are ahead of the train and to its left. NaN where the truth is not logged.

    Args:
        log: {name: Signal} of the run.
        times: times of the points [s], shape (n,).
        xy: points in W [m], shape (n, 2).
    """
    truth = train_pose(log, times)
    dx, dy = (np.asarray(xy, dtype=float) - truth[:, :2]).T
    cos, sin = np.cos(truth[:, 3]), np.sin(truth[:, 3])
    return np.column_stack([cos * dx + sin * dy, cos * dy - sin * dx])
