"""Which object a run was about, where vision tracks several: the target, and the train that was lifted.

The arm grasps whatever vision follows, which need not be the first train. Whether something was lifted is decided by
contact and height, see `GraspJudgeSystem`. This module only names the objects: the target is the object at the points
that led to the last descent, according to ground truth.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.grasp.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, interpolate_rows
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.vision_parts import tracks_several
from drake_tracker.world.objects_config import Train

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


def run_objects(scenario: TrainScenario, log: Log, spans: Sequence[PhaseSpan]) -> RunObjects:
    """Returns the objects that a run was about. With a vision of a single object they can only be the first train.

    Args:
        scenario: the scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    verdict, judged = log["truth_verdict"], log.get(_JUDGED)
    lifted = None
    if len(verdict.times) and verdict["taken"][-1]:
        trains = [0, *(k for k, each in enumerate(scenario.objects, start=1) if isinstance(each, Train))]
        lifted = trains[int(judged.data[-1, 0])] if judged is not None and len(judged.times) else 0
    return RunObjects(_target(log, spans) if tracks_several(scenario) else 0, lifted)


def about_target(scenario: TrainScenario, log: Log) -> Log:
    """Returns a log for everything that compares a run with the truth: its train is the object that was the target.

    Where the target is not the first train, the state of the target has the name of the first train's, whose own is
    under `FIRST_TRAIN`. Otherwise it is the given log.

    Args:
        scenario: the scenario of the run.
        log: {name: Signal} of the run.
    """
    target = run_objects(scenario, log, phase_spans(log, scenario.time_step)).target
    if not target:
        return log
    return {**log, FIRST_TRAIN: log[_STATE], _STATE: _states(log)[target]}


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
    distances = []
    for state in _states(log):
        away = np.hypot(*(interpolate_rows(stamps, state.times, state.view("x", "y")) - xy).T)
        away = away[np.isfinite(away)]
        distances.append(float(np.median(away)) if len(away) else np.inf)
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] <= NEAR else None


def _states(log: Log) -> list[Signal]:
    """Returns the true states of all objects, the first train's first."""
    others = log.get(_OTHER_STATES)
    if others is None:
        return [log[_STATE]]
    count = others.data.shape[1] // len(BODY_STATE)
    rows = np.split(others.data, count, axis=1)
    return [log[_STATE], *(Signal(others.times, row, tuple(BODY_STATE)) for row in rows)]
