"""The summary of a run: what came of it, and how well each part did, judged from truth after the event."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.grasp.schema import Phase
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.episode import Log, PhaseSpan, during, predictions_of_now
from drake_tracker.tasks.results import git_commit, lag_of, package_versions, tidy
from drake_tracker.tasks.train.closing import closing_onset_error
from drake_tracker.tasks.train.episode import errors, phase_spans, sighted
from drake_tracker.tasks.train.failure import failure_reason
from drake_tracker.tasks.train.scenario import TrainScenario

JITTER_WINDOW = 31
"""Samples of the moving mean that is taken away before jitter is measured."""


def summarise(scenario: TrainScenario, log: Log, simulated: float, interrupted: bool = False) -> dict[str, Any]:
    """Returns the summary of a run as a dict of numbers, texts and None (where there is nothing to say).

    Lengths in m, times in s, angles in rad. Position errors are horizontal, at the centre of the train's body:

    - ``prediction_rms_m``, ``prediction_p95_m``: the servo's target against the train at the instant for which the
      target holds (the lag and up to two servo periods ahead of what was seen), while tracking.
    - ``position_rms_m``: what the newest packet says of the present, while tracking.
    - ``triangulation_rms_m``: triangulated points against the train at their stamps, while vision is used;
      ``triangulation_jitter_m``: standard deviation of that error vector after its 31-sample moving mean is taken away.
    - ``vision_valid_fraction``: share of the cycles with a valid point, from the first centroid on, while vision is
      used.
    - ``lag_s``: from the capture of an image to the instant at which the prediction built on it can be read, the least
      and the greatest of the run.
    - ``time_to_grasp_s``: from the start of the run until the hand felt its grip and began to lift.
    - ``lift_height_m``: of the train in contact with a finger. ``hold_s``: longest time that it hung there, as judged.
    - ``closing_onset_error_s``: see `closing_onset_error`.
    - ``joint_limit_margin_rad``: least distance of a joint to its limit. ``speed_share``: greatest share of a joint's
      rated speed. ``longest_saturation_s``: of any drive. ``table_touched``: by the arm or the gripper.

    Args:
      scenario: the run's TrainScenario. log: {name: Signal}. simulated: time at which the run ended [s].
      interrupted: whether the user ended it.
    """
    spans = phase_spans(log, scenario.time_step)
    vision = _vision(log, spans)
    counts = log["diagnosis"]["attempts"]
    attempts = int(counts[-1]) if len(counts) else 0
    verdict = log["truth_verdict"]
    success = bool(len(verdict.times) and verdict["taken"][-1])
    lifts = [span.start for span in spans if span.phase == Phase.LIFT]
    summary = {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "success": success,
        "failure_reason": failure_reason(scenario, log, spans, vision["vision_valid_fraction"], interrupted),
        "attempts": attempts,
        "first_attempt_success": success and attempts == 1,
        "time_to_grasp_s": lifts[-1] if success and lifts else None,
        **_verdict(verdict),
        **arm_findings(log, limits_of(arm_of(scenario))),
        **_tracking(log, spans),
        **vision,
        "lag_s": lag_of(log, scenario.time_step),
        "closing_onset_error_s": closing_onset_error(scenario, log, spans),
        "simulated_s": simulated,
        "interrupted": bool(interrupted),
        "package_versions": package_versions(),
        "git_commit": git_commit(),
    }
    return tidy(summary)


def jitter(times: np.ndarray, error: np.ndarray) -> float:
    """Returns the standard deviation [m] of an error (n, 2) after a moving mean over `JITTER_WINDOW` samples is taken
    away.

    Of the vector: the root of the sum of both variances. NaN when there is no stretch that is long enough.
    """
    rest = without_mean(times, error)
    return float(np.sqrt(np.mean(np.sum(rest**2, axis=1)))) if len(rest) else math.nan


def without_mean(times: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Returns what is left (k, m) of an error (n, m) after a moving mean over `JITTER_WINDOW` samples is taken away.

    Only stretches of consecutive cycles count, ``times`` [s] tells them.
    """
    kernel = np.full(JITTER_WINDOW, 1.0 / JITTER_WINDOW)
    half = JITTER_WINDOW // 2
    rest = [np.zeros((0, error.shape[1]))]
    for stretch in np.split(error, np.nonzero(np.diff(times) > 1.5 * VISION_PERIOD)[0] + 1):
        if len(stretch) >= JITTER_WINDOW:
            mean = np.column_stack([np.convolve(axis, kernel, "valid") for axis in stretch.T])
            rest.append(stretch[half : len(stretch) - half] - mean)
    return np.concatenate(rest)


def _verdict(verdict: Signal) -> dict[str, Any]:
    touched = (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)
    return {
        "lift_height_m": max(verdict["lift"][touched], default=0.0),
        "hold_s": max(verdict["held"], default=0.0),
        "table_touched": bool(verdict["table_touched"].any()),
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
    """Returns the lengths (n,) of the error vectors (n, 2) that are known."""
    size = np.hypot(*error.T)
    return size[np.isfinite(size)]


def _rms(size: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(size**2))) if len(size) else None
