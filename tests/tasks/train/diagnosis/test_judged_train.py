"""Tests of which object a run was about, on made-up logs."""

from dataclasses import replace

import numpy as np
import pytest
from track_messages import track, track_points, tracks_signal

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.tasks.train.diagnosis.judged_train import (
    FIRST_TRAIN,
    RunObjects,
    Swap,
    about_target,
    object_name,
    run_objects,
    target_swaps,
)
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import summarise
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.world.train.objects_config import Ball, Train


@pytest.fixture
def two(episode, grasp_phases):
    """Makes (scenario, log) of a run with a ball and a second train 0.3 m beside the first, at the same speed.

    ``target``: 0 for points on the first train, 2 for points on the second. ``judged``: number of the train that the
    judge saw in the hand, 0 or 1, or None when none was lifted.
    """

    def make(target=0, judged=None):
        episode.phases = grasp_phases
        if judged is not None:
            episode.verdict["taken"] = lambda t: (t >= 5.5).astype(float)
        scenario = replace(
            episode.scenario.with_settings({"vision.method": SilhouetteTracker()}),
            objects=(Ball(), Train(body="striped")),
        )
        log = episode.log()
        first = log["truth_train_state"]
        ball, second = first.data.copy(), first.data.copy()
        ball[:, BODY_STATE.index("x")] += 1.0
        second[:, BODY_STATE.index("x")] += 0.3
        names = tuple(f"{field}_{k}" for k in range(2) for field in BODY_STATE)
        log["truth_object_states"] = Signal(first.times, np.hstack([ball, second]), names)
        log["truth_judged"] = Signal(first.times, np.full((len(first.times), 1), float(judged or 0)), ("train",))
        if target == 2:
            point = log["point"]
            data = point.data.copy()
            data[:, point.names.index("x")] += 0.3
            log["point"] = replace(point, data=data)
        return scenario, log

    return make


def found(scenario, log):
    return run_objects(resolve(scenario), log, phase_spans(log))


@pytest.mark.parametrize("target, judged, lifted", [(0, 0, 0), (0, None, None), (2, 1, 2), (2, 0, 0), (0, 1, 2)])
def test_the_target_is_the_object_at_the_points_and_the_judge_says_what_was_lifted(two, target, judged, lifted):
    objects = found(*two(target, judged))
    assert objects == RunObjects(target, lifted)
    assert objects.success is (lifted is not None and lifted == target)


def test_names():
    assert [object_name(k) for k in (None, 0, 1, 2)] == [None, "train", "objects[0]", "objects[1]"]


def test_points_near_no_object_name_no_target(two):
    scenario, log = two(2)
    log["truth_object_states"] = replace(log["truth_object_states"], data=log["truth_object_states"].data + 1.0)
    assert found(scenario, log).target is None
    assert found(scenario, {**log, "point": replace(log["point"], data=0.0 * log["point"].data)}).target is None


def test_a_log_about_the_first_train_is_the_log_itself(two, episode):
    scenario, log = two(0)
    assert about_target(resolve(scenario), log) is log
    assert about_target(resolve(episode.scenario), log) is log, "a vision of one object is judged on the first train"


def test_errors_are_those_of_the_target(two):
    scenario, log = two(2)
    about = about_target(resolve(scenario), log)
    assert np.array_equal(about[FIRST_TRAIN].data, log["truth_train_state"].data)
    assert about["truth_train_state"]["x"] == pytest.approx(log["truth_train_state"]["x"] + 0.3)
    assert summarise(resolve(scenario), log, 6.0)["triangulation_rms_m"] < 0.001


def test_the_second_train_counts_if_it_was_the_target(two):
    scenario, log = two(2, 1)
    summary = summarise(resolve(scenario), log, 6.0)
    assert summary["success"] is True and summary["failure_reason"] is None and summary["cause"] is None
    assert summary["tracking"]["target_object"] == summary["tracking"]["lifted_object"] == "objects[1]"
    assert "objects[1]" in summary["tracking"]["sentences"][0]


def test_another_train_than_the_target_does_not_count(two):
    scenario, log = two(0, 1)
    summary = summarise(resolve(scenario), log, 6.0)
    assert summary["success"] is False and summary["cause"] == "second_object"
    assert summary["failure_reason"] == "the hand lifted objects[1] instead of train, the target"
    assert summary["time_to_grasp_s"] is None


def test_a_vision_of_one_object_is_judged_as_before(two, episode):
    _, log = two(2, 0)
    summary = summarise(resolve(episode.scenario), log, 6.0)
    assert summary["success"] is True and "tracking" not in summary


def test_half_a_second_of_points_decides(two):
    scenario, log = two(0)
    point = log["point"]
    data = point.data.copy()
    late = (point["stamp"] > 2.2) & (point["stamp"] <= 3.0 + VISION_PERIOD)
    data[late, point.names.index("x")] += 0.3
    assert found(scenario, {**log, "point": replace(point, data=data)}).target == 2


def swapped(log, aside):
    """The log with the tracks 1, the target, ``aside(stamp)`` beside the first train, and 2, which stands far away."""
    truth = log["truth_train_state"]

    def message(k):
        stamp = k * VISION_PERIOD
        x, y = (float(np.interp(stamp, truth.times, truth[axis])) for axis in "xy")
        return track_points(stamp, [track(1, x + aside(stamp), y), track(2, 0.0, 0.0)], 1)

    return {**log, "tracks": tracks_signal(message, len(truth.times))}


def test_a_track_that_goes_over_to_another_object_is_found(two):
    scenario, log = two(0)
    spans = phase_spans(log)
    steady = swapped(log, lambda t: 0.02)
    assert target_swaps(steady, spans) == []
    short = swapped(log, lambda t: 0.3 if 1.5 < t < 1.8 else 0.0)
    assert target_swaps(short, spans) == [], "for less than half a second"
    over = swapped(log, lambda t: 0.3 * np.clip(2.0 * (t - 1.5), 0.0, 1.0))
    (swap,) = target_swaps(over, spans)
    assert swap == Swap(pytest.approx(1.5 + 0.5 * 0.22 / 0.3, abs=0.02), 1, 0, 2)
    assert target_swaps(about_target(resolve(scenario), over), spans) == [swap]
    summary = summarise(resolve(scenario), over, 6.0)
    assert summary["tracking"]["swaps"][0]["after"] == "objects[1]"
    assert "track 1 was on objects[1] instead of train" in summary["tracking"]["sentences"][-1]
    late = swapped(log, lambda t: 0.3 if t > 3.2 else 0.0)
    assert target_swaps(late, spans) == [], "the arm no longer uses vision"
