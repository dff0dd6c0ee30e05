"""Says in one sentence why the train was not lifted, from the log of a run."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import BY_HAND, PROGRAMS, Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, during
from drake_tracker.tasks.tracks import reason_shares, tell_reasons
from drake_tracker.tasks.train.closing import clearance, offset_at_touch
from drake_tracker.tasks.train.diagnosis.cause import main_troubles
from drake_tracker.tasks.train.diagnosis.trouble import Cause
from drake_tracker.tasks.train.episode import sighted
from drake_tracker.tasks.train.setup import TrainSetup

SEEN = 0.5
"""Fraction of the cycles with a valid point from which vision is not the reason."""
TURNED = 10.0
"""Angle between train and jaws [deg] from which on the reason names it."""
GATE_WORDS = {
    Gate.OPEN: "nothing held it back",
    Gate.NOT_TRACKING: "the hand was not tracking",
    Gate.SETTLING: "the hand was settling",
    Gate.FLIPPING: "the jaws were turning over",
    Gate.STALE: "no fresh prediction arrived",
    Gate.NO_MEMORY: "too few earlier predictions from the same place had been checked",
    Gate.PREDICTIONS_FAILED: "earlier predictions from the same place had not come true",
    Gate.SUCCESS_UNLIKELY: "success was not likely enough (grasp.launch_probability)",
    Gate.SURPRISES: "the path had surprised too often (grasp.launch_probability)",
    Gate.OUT_OF_REACH: "the meeting point was out of reach",
}
"""Reasons for which the gate stays closed, as clauses of a sentence."""

_GATE_WAITS_FOR = {
    Gate.SETTLING: "the hand to settle",
    Gate.FLIPPING: "the jaws to turn over",
    Gate.STALE: "a fresh prediction",
    Gate.NO_MEMORY: "predictions from this place that can be checked",
    Gate.PREDICTIONS_FAILED: "predictions from this place that come true",
    Gate.SUCCESS_UNLIKELY: "a likely success",
    Gate.SURPRISES: "a path without surprises",
    Gate.OUT_OF_REACH: "a meeting point within reach",
}
"""The arm's reason for waiting while tracking, by the verdict of the gate."""
_PHASE_WAITS_FOR = {
    Phase.ACQUIRE: "the train to be seen",
    Phase.HOVER: "a fresh prediction",
    **dict.fromkeys(BY_HAND, "the operator"),
}
"""The arm's reason for waiting in other phases."""


def activity(phase: Phase, gate: Gate, unseen: str = "") -> str:
    """Returns the phase and, after a colon, the reason for an unseen target or for waiting in this phase.

    Args:
        phase: the phase.
        gate: the gate's verdict.
        unseen: why there is no point of the target, or "". It is left out while the arm does not use vision.
    """
    if unseen and not PROGRAMS[phase].blind:
        return f"{phase.name.lower()}: {unseen}"
    reason = _GATE_WAITS_FOR.get(gate) if phase == Phase.TRACK else _PHASE_WAITS_FOR.get(phase)
    return phase.name.lower() + (f": waiting for {reason}" if reason else "")


class Failure(NamedTuple):
    """Why the train was not lifted.

    Attributes:
        reason: one sentence.
        cause: the most likely cause, for tables.
        further: other causes that were found.
    """

    reason: str
    cause: Cause
    further: tuple[Cause, ...] = ()


def explain_failure(
    setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan], valid_fraction: float | None, interrupted: bool
) -> Failure | None:
    """Returns why the train was not lifted, None when it was. `failure_reason` explains the arguments."""
    reason = failure_reason(setup, log, spans, valid_fraction, False)
    if reason is None:
        return None
    cause, others = Cause.MISSED if _attempts(log) else Cause.NOT_LEARNED, list[Cause]()
    troubles = main_troubles(setup, log, spans)
    if troubles:
        cause, *others = (trouble.cause for trouble in troubles)
        reason = "; also ".join([f"{troubles[0].sentence}; {reason}", *(each.sentence for each in troubles[1:])])
    return Failure(f"interrupted; until then {reason}" if interrupted else reason, cause, tuple(others))


def failure_reason(
    setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan], valid_fraction: float | None, interrupted: bool
) -> str | None:
    """Returns the reason of a failure in one sentence, or None when the train was lifted.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.
        valid_fraction: fraction of the cycles with a valid point, None when vision was never used.
        interrupted: whether the user ended the run.
    """
    verdict = log["truth_verdict"]
    if len(verdict.times) and verdict["taken"][-1]:
        return None
    derailed = bool(len(verdict.times) and verdict["derailed"][-1])
    attempts = _attempts(log)
    if attempts:
        reason = _last_attempt(setup, log, spans, attempts, derailed)
    elif derailed:
        reason = "the train left its track before the first attempt"
    elif any(span.phase == Phase.TRACK for span in spans):
        reason = "the gate never opened" + _waiting(log, spans, 0.0)
    elif valid_fraction is not None and valid_fraction > SEEN:
        reason = "the hand never followed the train, although vision saw it"
    else:
        seen = "no cycle" if not valid_fraction else f"{valid_fraction:.0%} of the cycles"
        reason = f"the train was never tracked: vision gave a valid point in {seen}"
        why = tell_reasons(reason_shares(log, lambda stamps: sighted(spans, stamps)))
        reason += f"; {why}" if why else ""
    return f"interrupted; until then {reason}" if interrupted else reason


def _attempts(log: Log) -> int:
    diagnosis = log["diagnosis"]
    return int(diagnosis["attempts"][-1]) if len(diagnosis.times) else 0


def _last_attempt(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan], attempts: int, derailed: bool) -> str:
    """Returns the outcome of the last attempt, as a sentence."""
    start = max(k for k, span in enumerate(spans) if span.phase == Phase.INTERCEPT)
    phases = [span.phase for span in spans[start:]]
    thrown = " and threw the train off its track" if derailed else ""
    if Phase.LIFT in phases:
        return _after_grip(log, spans[start].start, attempts, Phase.RETREAT in phases) + thrown
    if Phase.CLOSE not in phases and Phase.RETREAT in phases:
        return f"attempt {attempts} was aborted during the descent: success had become unlikely" + thrown
    if Phase.CLOSE not in phases:
        return f"the run ended during the descent of attempt {attempts}"
    if Phase.RETREAT not in phases and not derailed:
        return f"the run ended while the jaws of attempt {attempts} were closing"
    where = ""
    offset = offset_at_touch(setup, log, spans)
    if offset is not None:
        along, across, turn = abs(1e3 * offset[0]), abs(1e3 * offset[1]), abs(math.degrees(offset[2]))
        turned = f", turned by {turn:.0f} deg" if turn >= TURNED else ""
        reach = 1e3 * setup.grasp.reach
        end = f" and {reach:.0f} mm along are" if along > reach else " is"
        where = (
            f": at contact the train was {across:.0f} mm across and {along:.0f} mm along the jaws from their middle"
            f"{turned}; at most {1e3 * clearance(setup):.0f} mm across{end} possible"
        )
    reason = f"attempt {attempts} missed{thrown}{where}"
    if Phase.TRACK in phases and not derailed:
        reason += "; afterwards the gate did not open again" + _waiting(log, spans, spans[start].start)
    return reason


def _after_grip(log: Log, start: float, attempts: int, retreated: bool) -> str:
    verdict = log["truth_verdict"]
    since = verdict.times >= start
    touched = since & ((verdict["left_contact"] > 0) | (verdict["right_contact"] > 0))
    height = 1e3 * max(verdict["lift"][touched], default=0.0)
    if retreated or not touched[-1]:
        return f"attempt {attempts} gripped the train but dropped it at a height of at most {height:.0f} mm"
    return (
        f"attempt {attempts} held the train at a height of {height:.0f} mm, but for only {verdict['held'][-1]:.2f} s "
        "when the run ended"
    )


def _waiting(log: Log, spans: Sequence[PhaseSpan], since: float) -> str:
    """Returns how long the gate stayed closed while the hand tracked the train, and the most frequent reason.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
        since: time from which to look [s].
    """
    diagnosis = log["diagnosis"]
    tracking = during(spans, diagnosis.times, Phase.TRACK) & (diagnosis.times >= since)
    time = sum(span.end - max(span.start, since) for span in spans if span.phase == Phase.TRACK and span.end > since)
    reasons = Counter(Gate(int(gate)) for gate in diagnosis["gate"][tracking])
    for transient in (Gate.NOT_TRACKING, Gate.OPEN):
        reasons.pop(transient, None)
    if not reasons:
        return f" in {time:.1f} s of tracking"
    gate, count = reasons.most_common(1)[0]
    share = count / np.count_nonzero(tracking)
    return f" in {time:.1f} s of tracking: {GATE_WORDS[gate]} ({share:.0%} of that time)"
