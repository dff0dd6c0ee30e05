"""The summary of a run of the train: its outcome and the errors of each part, measured against ground truth."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_tracker.arm.hand_eye_correction import describe_doubt
from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.episode import Log, PhaseSpan, during, predictions_of_now
from drake_tracker.tasks.results import lag_of, limiter_findings, made_by, packet_findings, tidy
from drake_tracker.tasks.train.closing import aborted_launches, closing_onset_error, offset_at_touch
from drake_tracker.tasks.train.diagnosis.failure import Failure, explain_failure
from drake_tracker.tasks.train.diagnosis.judged_train import (
    RunObjects,
    about_target,
    object_name,
    run_objects,
    target_swaps,
)
from drake_tracker.tasks.train.diagnosis.trouble import Cause
from drake_tracker.tasks.train.diagnosis.trouble_tracking import tell_tracking, tracking_findings
from drake_tracker.tasks.train.episode import errors, phase_spans, sighted
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.vision.hand.wrist_measurement import WristReason

JITTER_WINDOW = 31
"""Number of samples in the moving mean that is subtracted before jitter is measured."""
SOURCES = ("none", "fixed", "wrist", "both")
"""Words for `WristPoint.source`, in its order."""


def summarise(setup: TrainSetup, log: Log, simulated: float, interrupted: bool = False) -> dict[str, Any]:
    """Returns the summary of a run, a dict of numbers, texts and None (where a value does not exist).

    Lengths are in m, times in s, angles in rad. Position errors are horizontal, at the centre of the train's body. The
    train is the first one or, if vision tracked several objects, the object that was the target at the last descent:

    - ``cause``: one of `drake_tracker.tasks.train.diagnosis.trouble.Cause`; None when the train was lifted.
    - ``further_causes``: other causes that were found.
    - ``prediction_rms_m``, ``prediction_p95_m``: error of the servo's target at the time for which it predicts, while
      tracking. This time is ahead of the newest measurement by the lag and up to two servo periods.
    - ``position_rms_m``: error of the present position according to the newest packet, while tracking.
    - ``triangulation_rms_m``: error of triangulated points at their stamps, while vision is used.
    - ``triangulation_jitter_m``: standard deviation of this error vector after its moving mean over 31 samples is
      subtracted.
    - ``vision_valid_fraction``: fraction of the cycles with a valid point, from the first centroid on, while vision is
      used.
    - ``lag_s``: smallest and greatest time from the capture of the middle image of the three that give a point, its
      stamp, to the instant at which the prediction based on it is available. The newest of the three is younger by the
      detector's ``stride``.
    - ``time_to_grasp_s``: time from the start of the run until the hand felt its grip and began to lift.
    - ``aborted_attempts``: how many of the ``attempts`` a guided hand gave up before its jaws closed.
    - ``touch_along_m``, ``touch_across_m``: see `offset_at_touch`.
    - ``lift_height_m``: greatest height of the train above the rail while a finger touches it.
    - ``hold_s``: longest time for which the train was held, according to the judge.
    - ``closing_onset_error_s``: see `closing_onset_error`; None unless the target is the first train.
    - ``joint_limit_margin_rad``: smallest distance of a joint from its limit.
    - ``speed_share``: greatest fraction of the rated speed of a joint.
    - ``longest_saturation_s``: longest saturation of a drive.
    - ``table_touched``: whether the arm or the gripper touched the table.
    - ``packets_rejected``, ``packets_rejected_for``: see `packet_findings`.
    - ``set_points_changed``, ``set_points_changed_for``: see `limiter_findings`.
    - ``hand_eye``: only if the hand has markers. ``used_fraction``: fraction of the run in which a correction rested on
      recent measurements; ``correction_m``: median length of these corrections; ``accepted`` and ``rejected``: number
      of measurements; ``last_rejection``: why the last one was rejected.
    - ``tracking``: only if vision tracked several objects: see `tracking_findings`. ``target_object`` and
      ``lifted_object``: "train" for the first train, "objects[k]" for one of the scenario's ``objects``, or None; a
      success is a target that was lifted. ``swaps``: {``time_s``, ``track``, ``before``, ``after``} for each time that
      the track of the target went over to another object, see `target_swaps`. ``sentences``: one for each kind of
      trouble, for the user.
    - ``wrist``: only if the hand carries a camera: see `wrist_findings`.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        simulated: time at which the run ended [s].
        interrupted: whether the user ended the run.
    """
    spans = phase_spans(log, setup.scenario.time_step)
    objects = run_objects(setup, log, spans)
    success = objects.success
    log = about_target(setup, log)
    vision = _vision(log, spans)
    counts = log["diagnosis"]["attempts"]
    attempts = int(counts[-1]) if len(counts) else 0
    verdict = log["truth_verdict"]
    failure = explain_failure(setup, log, spans, vision["vision_valid_fraction"], interrupted)
    if objects.lifted is not None and not success:
        names = object_name(objects.lifted), object_name(objects.target)
        failure = Failure("the hand lifted {} instead of {}, the target".format(*names), Cause.SECOND_OBJECT)
    lifts = [span.start for span in spans if span.phase == Phase.LIFT]
    summary = {
        "scenario": setup.scenario.name,
        "seed": setup.scenario.seed,
        "success": success,
        "failure_reason": None if failure is None else failure.reason,
        "cause": None if failure is None else str(failure.cause),
        "further_causes": [] if failure is None else [str(cause) for cause in failure.further],
        "attempts": attempts,
        "aborted_attempts": len(aborted_launches(spans, log, setup.grasp.object_width)),
        "first_attempt_success": success and attempts == 1,
        "time_to_grasp_s": lifts[-1] if success and lifts else None,
        **_touch(setup, log, spans),
        **_verdict(verdict),
        **arm_findings(log, limits_of(setup.arm)),
        **_tracking(log, spans),
        **vision,
        **packet_findings(log),
        **limiter_findings(log),
        **(_hand_eye(log) if setup.sees_hand else {}),
        **(_several(log, spans, objects) if setup.several else {}),
        **({"wrist": wrist_findings(log, spans)} if setup.has_wrist else {}),
        "lag_s": lag_of(log, setup.scenario.time_step),
        "closing_onset_error_s": closing_onset_error(setup, log, spans),
        "simulated_s": simulated,
        "interrupted": bool(interrupted),
        **made_by(),
    }
    return tidy(summary)


def jitter(times: np.ndarray, error: np.ndarray) -> float:
    """Returns the standard deviation of an error vector after subtraction of its moving mean [m].

    It is the root of the sum of the variances of all components.

    Args:
        times: times of the errors [s], shape (n,).
        error: error vectors [m], shape (n, 2).

    Returns NaN when there are no `JITTER_WINDOW` consecutive samples.
    """
    rest = without_mean(times, error)
    return float(np.sqrt(np.mean(np.sum(rest**2, axis=1)))) if len(rest) else math.nan


def without_mean(times: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Returns an error after subtraction of its moving mean over `JITTER_WINDOW` samples, shape (k, m).

    Only sequences of at least `JITTER_WINDOW` consecutive cycles are used.

    Args:
        times: times of the errors [s], shape (n,).
        error: errors, shape (n, m).
    """
    kernel = np.full(JITTER_WINDOW, 1.0 / JITTER_WINDOW)
    half = JITTER_WINDOW // 2
    rest = [np.zeros((0, error.shape[1]))]
    for stretch in np.split(error, np.nonzero(np.diff(times) > 1.5 * VISION_PERIOD)[0] + 1):
        if len(stretch) >= JITTER_WINDOW:
            mean = np.column_stack([np.convolve(axis, kernel, "valid") for axis in stretch.T])
            rest.append(stretch[half : len(stretch) - half] - mean)
    return np.concatenate(rest)


def _touch(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> dict[str, float | None]:
    along, across, _ = offset_at_touch(setup, log, spans) or (None, None, None)
    return {"touch_along_m": along, "touch_across_m": across}


def _verdict(verdict: Signal) -> dict[str, Any]:
    touched = (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)
    return {
        "lift_height_m": max(verdict["lift"][touched], default=0.0),
        "hold_s": max(verdict["held"], default=0.0),
        "table_touched": bool(verdict["table_touched"].any()),
        "self_touched": bool(verdict["self_touched"].any()),
    }


def _hand_eye(log: Log) -> dict[str, Any]:
    report = log["hand_correction"]
    used = report["used"] > 0
    lengths = np.linalg.norm(report.view("x", "y", "z")[used], axis=1)
    return {
        "hand_eye": {
            "used_fraction": np.count_nonzero(used) / len(used) if len(used) else None,
            "correction_m": float(np.median(lengths)) if len(lengths) else None,
            "accepted": int(max(report["accepted"], default=0)),
            "rejected": int(max(report["rejected"], default=0)),
            "last_rejection": describe_doubt(report["reason"][-1]) if len(used) else None,
        }
    }


def _several(log: Log, spans: Sequence[PhaseSpan], objects: RunObjects) -> dict[str, Any]:
    findings = tracking_findings(log, spans)
    target, lifted = object_name(objects.target), object_name(objects.lifted)
    swaps = [
        {"time_s": swap.time, "track": swap.track, "before": object_name(swap.before), "after": object_name(swap.after)}
        for swap in target_swaps(log, spans)
    ]
    sentences = tell_tracking(findings)
    if swaps:
        first = swaps[0]
        sentences.append(
            f"Vision mistook another object for the target: from {first['time_s']:.1f} s on, track {first['track']} "
            f"was on {first['after']} instead of {first['before']}."
        )
    if objects.target:
        sentences.insert(0, f"The target was {target} of the scenario; success and errors are about this object.")
    return {
        "tracking": {
            "target_object": target,
            "lifted_object": lifted,
            "swaps": swaps,
            **findings,
            "sentences": sentences,
        }
    }


def _tracking(log: Log, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    target = log["target"]
    good = (target["valid"] > 0) & during(spans, target.times, Phase.TRACK)
    ahead = _size(errors(log, target["time"], target.view("x", "y"))[good])
    now = predictions_of_now(log["delivered"])
    present = _size(errors(log, now.times, now.xy)[during(spans, now.times, Phase.TRACK)])
    return {
        "prediction_rms_m": _rms(ahead),
        "prediction_p95_m": float(np.percentile(ahead, 95)) if len(ahead) else None,
        "position_rms_m": _rms(present),
    }


def _vision(log: Log, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    point = log["point"]
    used = (point["stamp"] > 0) & sighted(spans, point["stamp"])
    valid = used & (point["valid"] > 0)
    stamps = point["stamp"][valid]
    error = errors(log, stamps, point.view("x", "y")[valid])
    return {
        "vision_valid_fraction": np.count_nonzero(valid) / np.count_nonzero(used) if used.any() else None,
        "triangulation_rms_m": _rms(_size(error)),
        "triangulation_jitter_m": jitter(stamps, error),
    }


def _size(error: np.ndarray) -> np.ndarray:
    """Returns the lengths of those error vectors, shape (n, 2), that are finite."""
    size = np.hypot(*error.T)
    return size[np.isfinite(size)]


def _rms(size: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(size**2))) if len(size) else None


def wrist_findings(log: Log, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    """Returns the entries of the summary about the camera on the hand. No ground truth is used.

    Times are stamps of images, while vision had a target or looked for one.

    - ``hover``, ``descent``: {word of `SOURCES`: share of the points}, while the hand follows the object at hover
      height, and from the launch until the jaws hold. None without an image.
    - ``reasons``: {name of the `WristReason`: share} over both.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    signal = log["wrist"]
    stamps = signal["stamp"]
    fresh = np.diff(stamps, prepend=0.0) > 0.0
    rows, stamps = signal.view("reason", "source")[fresh].astype(int), stamps[fresh]
    hover = during(spans, stamps, Phase.TRACK)
    descent = during(spans, stamps, Phase.INTERCEPT, Phase.CLOSE)
    return {
        "hover": _shares(rows[hover, 1], SOURCES),
        "descent": _shares(rows[descent, 1], SOURCES),
        "reasons": _shares(rows[hover | descent, 0], tuple(reason.name for reason in WristReason)),
    }


def _shares(numbers: np.ndarray, words: Sequence[str]) -> dict[str, float] | None:
    """Returns {word: share} of those numbers that occur, which are indices into the words; None without numbers."""
    if len(numbers) == 0:
        return None
    return {word: float(np.mean(numbers == k)) for k, word in enumerate(words) if (numbers == k).any()}
