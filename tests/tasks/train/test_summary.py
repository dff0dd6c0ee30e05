"""Tests of the summary of a run."""

import dataclasses
import json
import math

import numpy as np
import pytest

from drake_tracker.arm.config import Puma560
from drake_tracker.arm.hand_eye_correction import Doubt
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import HandCorrection
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.results import git_commit, save_summary
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import jitter, summarise

KEYS = {
    *("scenario", "seed", "success", "failure_reason", "attempts", "first_attempt_success", "time_to_grasp_s"),
    *("aborted_attempts", "touch_along_m", "touch_across_m"),
    *("lift_height_m", "hold_s", "prediction_rms_m", "prediction_p95_m", "position_rms_m", "vision_valid_fraction"),
    *("triangulation_rms_m", "triangulation_jitter_m", "lag_s", "closing_onset_error_s", "joint_limit_margin_rad"),
    *(
        "speed_share",
        "longest_saturation_s",
        "table_touched",
        "packets_rejected",
        "packets_rejected_for",
        "set_points_changed",
        "set_points_changed_for",
        "self_touched",
        "simulated_s",
        "interrupted",
        "package_versions",
    ),
    *("git_commit", "cause", "further_causes"),
}


def test_the_keys_are_the_same_for_every_run(scenario, episode, nothing):
    assert set(summarise(resolve(scenario), episode.log(), 6.0)) == KEYS
    empty = summarise(resolve(scenario), nothing, 0.0, interrupted=True)
    assert set(empty) == KEYS
    assert empty["success"] is False and empty["prediction_rms_m"] is None and empty["interrupted"] is True
    assert empty["touch_along_m"] is None and empty["touch_across_m"] is None


def test_a_hand_with_markers_says_how_often_it_was_corrected(scenario, episode, nothing):
    marked = dataclasses.replace(scenario, arm=Puma560(markers=True))
    log = episode.log()
    times, names = log["point"].times, HandCorrection.get_fields()
    data = np.zeros((len(times), len(names)))
    late = times >= 0.5 * times[-1]
    data[late, names.index("used")] = 1.0
    data[late, names.index("x")] = 0.03
    data[-1, [names.index(name) for name in ("accepted", "rejected", "reason")]] = 40, 2, Doubt.OUTLIER
    log["hand_correction"] = Signal(times, data, names)
    found = summarise(resolve(marked), log, 6.0)["hand_eye"]
    assert found["used_fraction"] == pytest.approx(0.5, abs=0.01) and found["correction_m"] == pytest.approx(0.03)
    assert (found["accepted"], found["rejected"]) == (40, 2)
    assert found["last_rejection"] == "it contradicts the measurements before it"
    assert summarise(resolve(marked), nothing, 0.0)["hand_eye"]["used_fraction"] is None


def test_a_success(scenario, episode, grasp_phases, known):
    episode.phases = grasp_phases
    episode.verdict = {
        "taken": lambda t: (t >= 5.5).astype(float),
        "left_contact": lambda t: (t >= 3.4).astype(float),
        "right_contact": lambda t: (t >= 3.4).astype(float),
        "lift": lambda t: np.clip(0.15 * (t - 3.5), 0.0, 0.15),
        "held": lambda t: np.clip(t - 4.5, 0.0, None),
    }
    summary = summarise(resolve(scenario), episode.log(), 6.0)
    assert (summary["scenario"], summary["seed"]) == ("straight", 5)
    assert summary["success"] is True and summary["failure_reason"] is None
    assert summary["attempts"] == 1 and summary["first_attempt_success"] is True
    assert summary["time_to_grasp_s"] == pytest.approx(known.tick(3.54), abs=1e-6)
    assert summary["lift_height_m"] == pytest.approx(0.15)
    assert summary["hold_s"] == pytest.approx(1.5)


def test_the_offset_at_touch_is_that_of_the_last_closing(scenario, episode, grasp_phases):
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.010 * t
    episode.verdict["left_contact"] = lambda t: (t >= 3.2).astype(float)
    summary = summarise(resolve(scenario), episode.log(), 6.0)
    assert summary["touch_across_m"] == pytest.approx(-0.032, abs=2e-4)
    assert summary["touch_along_m"] == pytest.approx(0.0, abs=1e-3)


def test_a_train_that_was_thrown_up_is_not_lifted(scenario, episode):
    episode.verdict["lift"] = lambda t: 0.3 * (t > 4.0)
    assert summarise(resolve(scenario), episode.log(), 6.0)["lift_height_m"] == 0.0


def test_prediction_errors_are_those_of_the_target_while_tracking(scenario, episode):
    """Every packet is 10 mm to the left; in the first second, before tracking, the error would be a metre."""
    episode.beside = lambda t: np.where(t < 1.0, 1.0, 0.010)
    summary = summarise(resolve(scenario), episode.log(), 6.0)
    assert summary["prediction_rms_m"] == pytest.approx(0.010, abs=1e-6)
    assert summary["prediction_p95_m"] == pytest.approx(0.010, abs=1e-6)


def test_position_error_is_that_of_the_newest_packet_for_the_present(scenario, episode):
    episode.beside = lambda t: 0.004 * np.sin(t)
    expected = np.sqrt(np.mean((0.004 * np.sin(np.arange(1.02, 6.0, VISION_PERIOD))) ** 2))
    summary = summarise(resolve(scenario), episode.log(), 6.0)
    assert summary["position_rms_m"] == pytest.approx(expected, rel=0.01)


def test_triangulation_error_and_jitter(scenario, episode):
    """A slow error of 6 mm contributes to the error only, white noise of 1 mm per axis to error and jitter."""
    rng = np.random.default_rng(1)
    episode.duration = 60.0
    episode.offsets = lambda t: np.column_stack([0.006 * np.sin(0.5 * t), 0.0 * t]) + rng.normal(0.0, 1e-3, (len(t), 2))
    summary = summarise(resolve(scenario), episode.log(), 60.0)
    expected = math.hypot(0.006 / math.sqrt(2), 0.001 * math.sqrt(2))
    assert summary["triangulation_rms_m"] == pytest.approx(expected, rel=0.05)
    assert summary["triangulation_jitter_m"] == pytest.approx(0.001 * math.sqrt(2), rel=0.05)


def test_errors_while_the_arm_is_blind_do_not_count(scenario, episode, grasp_phases):
    episode.phases = grasp_phases
    episode.offsets = lambda t: np.where(t > 3.02, 0.2, 0.001)[:, None] * [1.0, 0.0]
    episode.valid = lambda t: (t < 3.02).astype(float)
    summary = summarise(resolve(scenario), episode.log(), 6.0)
    assert summary["triangulation_rms_m"] == pytest.approx(0.001, rel=0.05)
    assert summary["vision_valid_fraction"] == 1.0


def test_valid_fraction_counts_from_the_first_centroid(scenario, episode):
    episode.valid = lambda t: (np.round(t / VISION_PERIOD) % 4 != 0).astype(float)
    assert summarise(resolve(scenario), episode.log(), 6.0)["vision_valid_fraction"] == pytest.approx(0.75, abs=0.005)


def test_the_lag_has_a_single_value(scenario, episode, known):
    lag = summarise(resolve(scenario), episode.log(), 6.0)["lag_s"]
    assert lag["min"] == lag["max"] == pytest.approx(known.LAG, abs=1e-6)


def test_the_summary_contains_the_limits_of_the_arm(scenario, episode):
    log = episode.log()
    log["arm_state"].data[500, 6 + 1] = -1.51 * 0.5  # half the rated speed of joint 2
    assert summarise(resolve(scenario), log, 6.0)["speed_share"] == pytest.approx(0.5, abs=1e-6)


def test_the_same_log_gives_the_same_summary(scenario, episode):
    assert summarise(resolve(scenario), episode.log(), 6.0) == summarise(resolve(scenario), episode.log(), 6.0)


def test_a_saved_summary_is_plain_json(tmp_path):
    summary = {"a": math.nan, "b": np.float64(1 / 3), "c": np.bool_(True), "d": [np.int64(4), math.inf], "e": None}
    save_summary(summary, tmp_path / "summary.json")
    text = (tmp_path / "summary.json").read_text()
    assert json.loads(text) == {"a": None, "b": 0.333333, "c": True, "d": [4, None], "e": None}


def test_jitter_ignores_sequences_shorter_than_its_window():
    times = VISION_PERIOD * np.arange(40)
    error = np.random.default_rng(0).normal(size=(40, 2))
    assert math.isfinite(jitter(times, error))
    times[20:] += 1.0
    assert math.isnan(jitter(times, error))


def test_commit_is_a_hash_or_none():
    commit = git_commit()
    assert commit is None or (len(commit) == 40 and set(commit) <= set("0123456789abcdef"))
