"""Finds the causes of a failure in the log of a run: the trouble that came first and mattered."""

from collections.abc import Sequence

from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan
from drake_tracker.tasks.train.diagnosis.trouble import Cause, Trouble
from drake_tracker.tasks.train.diagnosis.trouble_motion import (
    arm_troubles,
    gripper_troubles,
    motion_troubles,
    operator_troubles,
)
from drake_tracker.tasks.train.diagnosis.trouble_signals import (
    host_troubles,
    link_troubles,
    rejected_packets,
    vision_troubles,
)
from drake_tracker.tasks.train.setup import TrainSetup

FORGOTTEN = 3.0
"""Time before a descent [s] within which trouble can have spoilt it."""
NOTICEABLE = 0.05
"""Fraction of the run for which trouble must last if it kept the hand from descending."""
LONGER = 2.0
"""Difference of durations [s] by which one trouble outlasts another."""
_MOTION = (*(Cause.TRAIN_LOST, Cause.DERAILED, Cause.TRAIN_DISPLACED, Cause.TRAIN_REVERSED, Cause.TRAIN_STOPPED),)


def main_trouble(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> Trouble | None:
    """Returns the trouble to which a failure is most likely due, see `main_troubles`; None without any."""
    return next(iter(main_troubles(setup, log, spans)), None)


def main_troubles(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> list[Trouble]:
    """Returns the trouble to which a failure may be due, one for each cause, the most likely one first.

    There is none when nothing in the log was out of the ordinary.

    Ground truth is used, as in every judgement after a run; the settings of injected faults are not. Events after the
    hand touched the train are consequences. They count only if nothing was wrong before. The hand reaches the train
    when the jaws begin to close; from then on, the hand may move the train.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    if not spans or len(log["truth_train_state"].times) < 2:
        return []
    end = spans[-1].end
    touch = first_touch(log)
    until = end if touch is None else touch
    closings = [span.start for span in spans if span.phase == Phase.CLOSE]
    launches = [span.start for span in spans if span.phase == Phase.INTERCEPT]
    found = [
        *motion_troubles(setup, log, min([until, *closings])),
        *_signal_troubles(setup, log, spans, until),
        *gripper_troubles(setup, log, spans, until),
    ]
    if not found and until < end:
        found = _signal_troubles(setup, log, spans, end)
    mattered = [trouble for trouble in found if _mattered(trouble, found, launches, end)]
    order = list(Cause)

    def rank(trouble: Trouble) -> tuple[int, float, int, float]:
        """Trouble with the train comes first, then the longest trouble, and the end of the track last."""
        if trouble.cause in _MOTION:
            return 0, 0.0, order.index(trouble.cause), trouble.start
        lasted = _lasted(trouble.cause, mattered) // LONGER
        return 1 + (trouble.cause is Cause.TRACK_END), -lasted, order.index(trouble.cause), trouble.start

    first_of: dict[Cause, Trouble] = {}
    for trouble in sorted(mattered, key=rank):
        first_of.setdefault(trouble.cause, trouble)
    return list(first_of.values())


def first_touch(log: Log) -> float | None:
    """Returns the time at which a finger first touched the train [s], None when it never did."""
    verdict = log["truth_verdict"]
    touched = verdict.times[(verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)]
    return float(touched[0]) if len(touched) else None


def _signal_troubles(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan], until: float) -> list[Trouble]:
    return [
        *rejected_packets(log, until),
        *host_troubles(log, until),
        *link_troubles(log, until),
        *vision_troubles(setup, log, spans, until),
        *arm_troubles(log, until),
        *operator_troubles(spans, until),
    ]


def _mattered(trouble: Trouble, found: Sequence[Trouble], launches: Sequence[float], end: float) -> bool:
    """Returns whether trouble can have spoilt a descent, or prevented every one."""
    if trouble.cause in (*_MOTION, Cause.GRIPPER, Cause.TRACK_END):
        return True
    if launches:
        return any(trouble.end > launch - FORGOTTEN for launch in launches)
    return _lasted(trouble.cause, found) >= NOTICEABLE * end


def _lasted(cause: Cause, found: Sequence[Trouble]) -> float:
    """Returns for how long trouble of one cause lasted [s]."""
    return sum(trouble.end - trouble.start for trouble in found if trouble.cause is cause)
