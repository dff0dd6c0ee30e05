"""Tests of the faults that the benchmark of the autopsy puts in: each reaches the part that it means."""

import numpy as np
import pytest
from methods.autopsy_faults import FAULTS, Smoothed, Straightened

from drake_tracker.estimation import make_estimator
from drake_tracker.report.failure_diagnosis.stages import Stage
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.registry import make_diagram


def test_there_is_a_fault_for_every_stage():
    assert {fault.stage for fault in FAULTS.values()} == {*Stage, None}


@pytest.mark.parametrize("name", [name for name, fault in FAULTS.items() if "!Measured" in str(fault.overrides(1.0))])
def test_a_diagram_with_the_fault_can_be_built(name):
    fault = FAULTS[name]
    scenario = load_scenario("train:learned", seed=1, overrides=fault.overrides(fault.size))
    with fault.part(fault.size):
        make_diagram(scenario)


def drive(estimator):
    state = estimator.initial_state()
    for t in np.arange(0.0, 2.0, 1 / 60):
        angle = t / 1.5
        state = estimator.update(state, t, np.array([0.15 * np.cos(angle), 0.15 * np.sin(angle), 0.0]))
    return state


def test_a_low_pass_lags_by_its_time_constant():
    plain, late = make_estimator("closed_path"), Smoothed(make_estimator("closed_path"), 0.1)
    states = drive(plain), drive(late)
    places = [estimator.predict(state, [state.stamp])[0] for estimator, state in zip((plain, late), states)]
    assert np.linalg.norm(places[0][:2] - places[1][:2]) == pytest.approx(0.1 * 0.1, rel=0.15)


def test_a_straightened_prediction_is_right_at_the_stamp_and_leaves_the_bend():
    plain = make_estimator("closed_path")
    straight = Straightened(plain, 1.0)
    state = drive(straight)
    times = state.stamp + np.array([0.0, 0.6])
    a, b = plain.predict(state, times), straight.predict(state, times)
    assert a[0] == pytest.approx(b[0])
    assert np.linalg.norm(a[1] - b[1]) > 0.01
