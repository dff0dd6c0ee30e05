"""The autopsy of a run: its attempts, the stage that caused a failure, and both in words."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING
from drake_tracker.report.failure_diagnosis.evidence import Attempt, Evidence
from drake_tracker.report.failure_diagnosis.sentences import tell_attempt, tell_run, tell_unseen
from drake_tracker.report.failure_diagnosis.stages import NORMAL_ATTEMPT, NORMAL_TRACKING, WORDS, Stage
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.tracks import reason_shares
from drake_tracker.tasks.train.diagnosis.cause import main_trouble
from drake_tracker.tasks.train.diagnosis.judged_train import about_target
from drake_tracker.tasks.train.diagnosis.trouble import Cause
from drake_tracker.tasks.train.diagnosis.trouble_tracking import tell_tracking, tracking_findings
from drake_tracker.tasks.train.episode import phase_spans, sighted
from drake_tracker.tasks.train.setup import TrainSetup, resolve

LEAST_BLAME = 0.002
"""A stage whose excess is less than this [m] is not blamed."""
LATE = 0.1
"""Jaws that reach the train's width this much [s] after the planned time are late; up to half of it is normal. A link
is late if its packets are on average this much older than the host's newest packets; packets of a working link are not
older."""
YAW_ARM = 0.05
"""Distance [m] from the middle at which a yaw of the hand counts as an offset: half the gripped length of the train."""


def perform(scenario: BaseScenario, log: Mapping[str, Signal]) -> dict[str, Any]:
    """Returns the autopsy of a run of the train as a dict of numbers and texts, fit for JSON. Lengths in m, times in s.

    - ``culprit``: name of the stage with the largest excess over its normal contribution; None when the train was
      lifted or no stage did. ``excess_m``: {stage: its excess over normal}, largest first.
    - ``verdict``: one or two sentences on the run, None when the train was lifted. Trouble outside of the stages, such
      as a train that was stopped or a camera that saw nothing, comes first. Trouble with the tracking of several
      objects comes last.
    - ``attempts``: a dict for each descent: ``sentence``, ``outcome``, its times, ``culprit``, ``offset`` and
      ``contributions`` {stage: (along, across, up, yaw)}, which add up to it, ``size_m`` {stage: m}, ``ages_s``.
    - ``tracking``: the contributions while tracking: number of ``moments`` evaluated, ``size_m`` {stage: 68th
      percentile}, ``rms`` {stage: (along, across, up, yaw)}, ``age_s``: mean age of the packet in force relative to the
      host's newest.

    Args:
        scenario: of the run.
        log: {name: Signal}.
    """
    setup = resolve(scenario)
    log = about_target(setup, log)
    spans = phase_spans(log, scenario.time_step)
    evidence = Evidence(setup, log, spans)
    attempts, tracking = evidence.attempts(), evidence.tracking()
    lifted = any(attempt.outcome == "lifted" for attempt in attempts)
    failed = _judged(attempts)
    # After a miss the train may stand still or lie beside its track: that is a consequence, not a cause.
    before = tracking.times < attempts[0].launch if attempts else np.full(len(tracking.times), True)
    unseen = reason_shares(log, lambda stamps: sighted(spans, stamps))
    found = run_excess([attempt.rows for attempt in failed if attempt.rows is not None], tracking.rows[before])
    broken = broken_stage(log)
    lateness = float(np.median([attempt.timing for attempt in failed])) if failed else 0.0
    age = float(tracking.ages[before].mean()) if before.any() else 0.0
    culprit = None if lifted else broken if broken is not None else _worst(found, lateness, age)
    troubles = tell_tracking(tracking_findings(log, spans)) if setup.several else []
    described = [_attempt(setup, attempt) for attempt in attempts]
    order = np.argsort(-found)
    return {
        "culprit": None if culprit is None else WORDS[culprit],
        "verdict": None
        if lifted
        else _verdict(setup, log, spans)
        + tell_run(culprit, found, broken, described)
        + tell_unseen(unseen)
        + "".join(f" {each}" for each in troubles),
        "excess_m": _named(found[order], order),
        "attempts": described,
        "tracking": {
            "moments": len(tracking.times),
            "size_m": _named(usual_sizes(tracking.rows)),
            "rms": _named(_rms(tracking.rows)),
            "age_s": float(tracking.ages.mean()) if len(tracking.ages) else None,
        },
    }


def _verdict(setup: TrainSetup, log: Mapping[str, Signal], spans: Sequence[PhaseSpan]) -> str:
    """Returns the sentence on the main trouble of a run and a space, or "" when the stages show it themselves."""
    trouble = main_trouble(setup, log, spans)
    if trouble is None or trouble.cause in (Cause.CALIBRATION, Cause.SECOND_OBJECT, Cause.IMAGE_DISTURBED):
        return ""
    return f"{trouble.sentence[0].upper()}{trouble.sentence[1:]}. "


def _judged(attempts: Sequence[Attempt]) -> list[Attempt]:
    """Returns the failed attempts; without failed attempts, the attempts that the end of the run interrupted."""
    known = [attempt for attempt in attempts if attempt.rows is not None]
    failed = [attempt for attempt in known if attempt.outcome in ("missed", "dropped")]
    return failed or [attempt for attempt in known if attempt.outcome == "ended"]


def broken_stage(log: Mapping[str, Signal]) -> Stage | None:
    """Returns the first stage that never produced valid output in a run, or None when the servo had a target."""
    if (log["target"]["valid"] > 0).any():
        return None
    if (log["delivered"]["valid"] > 0).any():
        return Stage.LINK if _outdated(log) else Stage.SERVO
    if (log["prediction"]["valid"] > 0).any():
        return Stage.LINK
    if (log["point"]["valid"] > 0).any():
        return Stage.FILTER
    sides = [log[name]["valid"] > 0 for name in ("centroid_left", "centroid_right") if name in log]
    return Stage.TRIANGULATION if len(sides) == 2 and (sides[0] & sides[1]).any() else Stage.VISION


def _outdated(log: Mapping[str, Signal]) -> bool:
    """Returns whether the paths of most packets from the link had ended, while the paths of the host's newest packets
    had not."""
    delivered, prediction = log["delivered"], log["prediction"]
    here = delivered["valid"] > 0
    ends = [signal["first_time"][here] + KNOT_SPACING * (KNOT_COUNT - 1) for signal in (delivered, prediction)]
    times = delivered.times[here]
    return bool(np.mean((ends[0] < times) & (ends[1] >= times)) > 0.5)


def _worst(found: np.ndarray, lateness: float, age: float = 0.0) -> Stage | None:
    """Returns the stage with the largest excess.

    When no excess is large enough, it is the timing if the jaws were late, or the link if its packets were old.

    Args:
        found: excess, shape (7,) [m].
        lateness: of the jaws [s].
        age: of the packets relative to the host's newest [s].
    """
    worst = Stage(int(np.argmax(found)))
    if found[worst] >= LEAST_BLAME:
        return worst
    if lateness > LATE:
        return Stage.TIMING
    return Stage.LINK if age > LATE else None


def _attempt(setup: TrainSetup, attempt: Attempt) -> dict[str, Any]:
    """Returns an attempt as a dict, see `perform`."""
    described: dict[str, Any] = {
        "number": attempt.number,
        "outcome": attempt.outcome,
        "launch_s": attempt.launch,
        "close_s": attempt.close,
        "meeting_s": attempt.meeting,
        "end_s": attempt.end,
        "lifted_m": float(attempt.lifted),
        "ages_s": {WORDS[stage]: float(age) for stage, age in attempt.ages.items()},
        "culprit": None,
    }
    if attempt.rows is not None:
        described |= {
            "offset": attempt.rows.sum(axis=0).tolist(),
            "contributions": _named(attempt.rows),
            "size_m": _named(sizes(attempt.rows)),
        }
        if attempt.outcome in ("missed", "dropped"):
            worst = _worst(attempt_excess(attempt.rows), attempt.timing)
            described["culprit"] = None if worst is None else WORDS[worst]
    return described | {"sentence": tell_attempt(setup, described)}


def _named(rows: np.ndarray, order: Iterable[int] = Stage) -> dict[str, Any]:
    """Returns {name of the stage: row, as plain numbers}, for rows in an order of stages."""
    return {WORDS[Stage(int(stage))]: np.asarray(row).tolist() for stage, row in zip(order, rows)}


def _rms(rows: np.ndarray) -> np.ndarray:
    known = np.maximum(np.count_nonzero(np.isfinite(rows), axis=0), 1)
    return np.sqrt(np.nansum(rows**2, axis=0) / known)


def sizes(rows: np.ndarray) -> np.ndarray:
    """Returns the lengths of contributions, shape (...) [m]; yaw counts as the displacement at `YAW_ARM`.

    Args:
        rows: along, across, up [m], yaw [rad], shape (..., 4).
    """
    return np.sqrt(np.sum((rows * [1.0, 1.0, 1.0, YAW_ARM]) ** 2, axis=-1))


def usual_sizes(rows: np.ndarray) -> np.ndarray:
    """Returns the 68th percentiles of the lengths of contributions, shape (7,) [m]; 0 where all are unknown.

    For normally distributed errors the percentile is about their root mean square, and it is insensitive to a single
    jump, as when a lap closes.

    Args:
        rows: shape (n, 7, 4), NaN where unknown.
    """
    found = [column[np.isfinite(column)] for column in sizes(rows).T]
    return np.array([np.quantile(column, 0.68) if len(column) else 0.0 for column in found])


def excess(size: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Returns the excess of a length over the normal one [m]: the root of the difference of their squares, or 0."""
    return np.sqrt(np.maximum(np.square(size) - np.square(normal), 0.0))


def attempt_excess(rows: np.ndarray) -> np.ndarray:
    """Returns the excess (7,) [m] of an attempt's contributions (7, 4)."""
    return excess(sizes(rows), np.array(NORMAL_ATTEMPT))


def tracking_excess(rows: np.ndarray) -> np.ndarray:
    """Returns the excess (7,) [m] of the contributions (n, 7, 4) while tracking."""
    return excess(usual_sizes(rows), np.array(NORMAL_TRACKING))


def run_excess(attempts: Sequence[np.ndarray], tracking: np.ndarray) -> np.ndarray:
    """Returns the excess (7,) [m] by which each stage is judged over a whole run.

    It is the larger of two: the excess while tracking, and the median excess over the failed attempts. The median keeps
    one unusual attempt from deciding.

    Args:
        attempts: contributions (7, 4) of each failed attempt.
        tracking: contributions while tracking, shape (n, 7, 4).
    """
    found = tracking_excess(tracking) if len(tracking) else np.zeros(len(Stage))
    if len(attempts):
        found = np.maximum(found, np.median([attempt_excess(rows) for rows in attempts], axis=0))
    return found
