"""Which object a run was about, where vision tracks several: the target, and the train that was lifted.

The arm grasps whatever vision follows, which need not be the first train. Whether something was lifted is decided by
contact and height, see `GraspJudgeSystem`. This module only names the objects: the target is the object at the points
that led to the last descent, according to ground truth.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import TrackPoints
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, interpolate_rows
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.tasks.tracks import fresh_tracks, logged_tracks
from drake_tracker.tasks.train.episode import phase_spans, sighted
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.world.train.objects_config import Train

FIRST_TRAIN = "truth_first_train_state"
"""Name of the signal with the first train's state in a log that is about another object."""
NEAR = 0.08
"""Distance between points and an object [m] up to which they are points of this object."""
POINTS = 30
"""Number of points before a descent by which the target is recognised."""
_STATE, _OTHER_STATES, _JUDGED = "truth_train_state", "truth_object_states", "truth_judged"


class RunObjects(NamedTuple):
    """The objects that a run was about, as numbers: 0 is the first train, k the k-th of the scenario's ``objects``.

    Attributes:
        target: the object that was the target at the last descent or, without one, at the end; None if it is unknown.
        lifted: the train that was lifted, None when none was.
    """

    target: int | None
    lifted: int | None

    @property
    def success(self) -> bool:
        """Whether the target was lifted."""
        return self.lifted is not None and self.target in (None, self.lifted)


class Swap(NamedTuple):
    """The track of the target went over to another object.

    Attributes:
        time: stamp of its first point on the other object [s].
        track: number of the track.
        before: the object before, as in `RunObjects`.
        after: the object afterwards.
    """

    time: float
    track: int
    before: int
    after: int


def run_objects(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> RunObjects:
    """Returns the objects that a run was about. With a vision of a single object they can only be the first train.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    verdict, judged = log["truth_verdict"], log.get(_JUDGED)
    lifted = None
    if len(verdict.times) and verdict["taken"][-1]:
        trains = [0, *(k for k, each in enumerate(setup.scenario.objects, start=1) if isinstance(each, Train))]
        lifted = trains[int(judged.data[-1, 0])] if judged is not None and len(judged.times) else 0
    return RunObjects(_target(log, spans) if setup.several else 0, lifted)


def target_swaps(log: Log, spans: Sequence[PhaseSpan]) -> list[Swap]:
    """Returns where the track of the target went over from one object to another, in order of time.

    The object must be the nearest one to `POINTS` points of the track in a row before, and another one afterwards. Only
    the time in which the arm uses vision counts.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    messages = fresh_tracks(log)
    stamp, target = (messages[:, TrackPoints.get_fields().index(name)] for name in ("stamp", "target"))
    targets = dict(zip(stamp.tolist(), target.tolist()))
    swaps = []
    for track in logged_tracks(log):
        used = track.seen & np.array([targets[time] == track.number for time in track.times.tolist()], bool)
        used &= sighted(spans, track.times)
        times = track.times[used]
        if not len(times):
            continue
        distances = _distances(log, times, track.xyz[used, :2])
        nearest = np.where(distances.min(axis=0) <= NEAR, distances.argmin(axis=0), -1)
        edges = np.concatenate([[0], np.nonzero(np.diff(nearest))[0] + 1, [len(nearest)]])
        lasting = [a for a, b in zip(edges, edges[1:]) if nearest[a] >= 0 and b - a >= POINTS]
        for a, b in zip(lasting, lasting[1:]):
            if nearest[a] != nearest[b]:
                swaps.append(Swap(float(times[b]), track.number, int(nearest[a]), int(nearest[b])))
    return sorted(swaps, key=lambda swap: swap.time)


def about_target(setup: TrainSetup, log: Log) -> Log:
    """Returns a log for everything that compares a run with the truth: its train is the object that was the target.

    Where the target is not the first train, the state of the target has the name of the first train's, whose own is
    under `FIRST_TRAIN`. Otherwise it is the given log.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
    """
    target = run_objects(setup, log, phase_spans(log, setup.scenario.time_step)).target
    if not target:
        return log
    states = _states(log)
    return {**log, FIRST_TRAIN: states[0], _STATE: states[target]}


def object_name(number: int | None) -> str | None:
    """Returns the name of an object of `RunObjects`: the setting of the scenario that describes it."""
    if number is None:
        return None
    return "train" if number == 0 else f"objects[{number - 1}]"


def _target(log: Log, spans: Sequence[PhaseSpan]) -> int | None:
    point = log["point"]
    launches = [span.start for span in spans if span.phase == Phase.INTERCEPT]
    until = launches[-1] if launches else np.inf
    known = np.nonzero((point["valid"] > 0) & (point["stamp"] > 0.0) & (point["stamp"] <= until))[0][-POINTS:]
    if not len(known):
        return None
    stamps, xy = point["stamp"][known], point.view("x", "y")[known]
    distances = np.median(_distances(log, stamps, xy), axis=1)
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] <= NEAR else None


def _distances(log: Log, stamps: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Returns the horizontal distances of points from each object at their stamps [m], infinite where it is unknown.

    Args:
        log: {name: Signal} of the run.
        stamps: of the points [s], shape (n,).
        xy: the points in W [m], shape (n, 2).

    Returns shape (number of objects, n).
    """
    rows = [np.hypot(*(interpolate_rows(stamps, state.times, state.view("x", "y")) - xy).T) for state in _states(log)]
    return np.nan_to_num(np.array(rows), nan=np.inf)


def _states(log: Log) -> list[Signal]:
    """Returns the true states of all objects, the first train's first."""
    first, others = log.get(FIRST_TRAIN, log[_STATE]), log.get(_OTHER_STATES)
    if others is None:
        return [first]
    count = others.data.shape[1] // len(BODY_STATE)
    rows = np.split(others.data, count, axis=1)
    return [first, *(Signal(others.times, row, tuple(BODY_STATE)) for row in rows)]
