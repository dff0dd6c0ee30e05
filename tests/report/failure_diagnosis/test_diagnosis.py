"""The autopsy of synthetic runs, in each of which one thing is wrong."""

import re

import numpy as np
import pytest
from autopsy_run import SPEED, AutopsyRun

from drake_tracker.report.failure_diagnosis.diagnosis import perform
from drake_tracker.report.failure_diagnosis.stages import WORDS
from drake_tracker.tasks.episode import tool_pose
from drake_tracker.tasks.train.episode import train_pose

FAULTS = {
    "vision": {"noise": 12.0},
    "triangulation": {"shift": 0.03},
    "filter": {"lag": 0.4},
    "prediction": {"slower": 0.6},
    "link": {"age": 1.6, "slower": 0.1},
    "servo": {"beside": 0.03},
    "grasp timing": {"early": 0.2},
}
"""{stage: arguments of `AutopsyRun` that make it fail}. A predictor that is right at any age of its packet hides an old
packet, so for the link the predicted train is also a little too slow."""


def autopsy(**faults):
    run = AutopsyRun(**faults)
    return perform(run.scenario(), run.log())


@pytest.mark.parametrize("stage", FAULTS)
def test_the_stage_at_fault_is_named(stage):
    found = autopsy(**FAULTS[stage])
    assert found["culprit"] == stage
    assert re.search(rf"The main cause was (the )?{stage}\b", found["verdict"])
    (attempt,) = found["attempts"]
    assert attempt["outcome"] == "missed"
    if stage != "vision":  # the noise may be small at that moment
        assert attempt["culprit"] == stage
        assert re.search(rf"The main cause was (the )?{stage}\b", attempt["sentence"])


@pytest.mark.parametrize("stage", ["vision", "triangulation", "filter", "prediction", "link", "servo"])
def test_a_run_without_a_descent_has_a_culprit(stage):
    found = autopsy(**FAULTS[stage], attempts=False)
    assert found["attempts"] == []
    assert found["culprit"] == stage
    assert found["verdict"].startswith("The hand was never sent down")


@pytest.mark.parametrize("stage", FAULTS)
def test_the_contributions_add_up_to_the_offset_of_the_hand(stage):
    run = AutopsyRun(**FAULTS[stage])
    log = run.log()
    (attempt,) = perform(run.scenario(), log)["attempts"]
    rows = np.array(list(attempt["contributions"].values()))
    (train,), (hand,) = (pose(log, [attempt["meeting_s"]]) for pose in (train_pose, tool_pose))
    dx, dy, dz, _ = hand - train  # the train drives along +y
    up = dz - run.scenario().grasp.grasp_height
    assert rows.sum(axis=0)[:3] == pytest.approx([dy, -dx, up], abs=1e-9)
    assert attempt["offset"] == pytest.approx(rows.sum(axis=0).tolist())


def test_a_lag_is_reported_in_millimetres_and_milliseconds():
    (attempt,) = autopsy(lag=0.4)["attempts"]
    along, across, _, _ = attempt["contributions"]["filter"]
    assert along == pytest.approx(-0.4 * SPEED, abs=0.001) and across == pytest.approx(0.0, abs=0.001)
    assert attempt["ages_s"]["filter"] == pytest.approx(0.4, abs=0.01)
    assert "(400 ms behind)" in attempt["sentence"]


def test_jaws_that_close_early_close_too_high():
    (attempt,) = autopsy(early=0.2)["attempts"]
    assert attempt["ages_s"]["grasp timing"] == pytest.approx(-0.2, abs=0.06)
    assert attempt["contributions"]["grasp timing"][2] > 0.02
    assert "too early" in attempt["sentence"]


def test_slow_jaws_are_blamed_when_nothing_else_is_wrong():
    found = autopsy(slow=0.7)
    assert found["culprit"] == "grasp timing"
    assert "too late" in found["attempts"][0]["sentence"] and "more than normal" not in found["verdict"]


def test_the_age_of_late_packets_is_reported():
    found = autopsy(age=0.5)
    assert found["tracking"]["age_s"] == pytest.approx(0.5, abs=0.03)


def test_a_lifted_train_has_no_culprit():
    found = autopsy(lifted=True)
    assert found["culprit"] is None and found["verdict"] is None
    (attempt,) = found["attempts"]
    assert attempt["outcome"] == "lifted" and "lifted the train" in attempt["sentence"]


def test_no_stage_is_blamed_when_nothing_is_wrong():
    found = autopsy(attempts=False)
    assert found["culprit"] is None
    assert "no stage did worse" in found["verdict"]


@pytest.mark.parametrize(
    ("dead", "stage"),
    [
        (("point", "prediction", "delivered", "target"), "triangulation"),
        (("centroid_left", "point", "prediction", "delivered", "target"), "vision"),
        (("prediction", "delivered", "target"), "filter"),
        (("delivered", "target"), "link"),
        (("target",), "servo"),
    ],
)
def test_a_broken_chain_is_blamed_on_the_stage_where_it_breaks(dead, stage):
    run = AutopsyRun(attempts=False)
    log = run.log()
    for name in dead:
        log[name].data[:, log[name].names.index("valid")] = 0.0
    found = perform(run.scenario(), log)
    assert found["culprit"] == stage
    assert found["verdict"].lower().endswith(f"{stage} never produced valid output.")


def test_packets_whose_path_has_ended_on_arrival_are_blamed_on_the_link():
    run = AutopsyRun(attempts=False)
    log = run.log()
    log["delivered"].data[:, :3] -= [2.0, 0.0, 2.0]
    log["target"].data[:, -1] = 0.0
    assert perform(run.scenario(), log)["culprit"] == "link"


def test_measured_vision_has_no_centroids_and_no_triangulation():
    run = AutopsyRun(shift=0.03)
    log = run.log()
    del log["centroid_left"], log["centroid_right"]
    found = perform(run.scenario(), log)
    assert found["culprit"] == "vision"
    assert found["tracking"]["size_m"]["triangulation"] == 0.0


def test_stages_are_sorted_by_their_excess():
    found = autopsy(beside=0.03)
    excess = list(found["excess_m"].values())
    assert excess == sorted(excess, reverse=True) and set(found["excess_m"]) == set(WORDS.values())
