"""Tests of the scenarios that the benchmark of train grasps runs."""

import pytest
import train_grasp

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.registry import snake_case
from drake_tracker.tasks import load_scenario

DETECTOR_CELLS = ("cast-shadows-gated",)
"""Cells that set the motion detector of a single object, which the scenario of several objects refuses."""


def scenario_of(rung, cell, estimator=None, overrides=()):
    spec, _, _, seed, own = train_grasp.make_job(rung, estimator or train_grasp.RUNGS[rung], cell, 7, overrides)
    return load_scenario(spec, seed=seed, overrides=own)


def test_the_cell_line_of_the_learned_path_is_the_scenario_of_the_line():
    line = load_scenario("train:line", seed=7)
    same = {"name": line.name, "description": line.description}
    assert scenario_of("train:learned", "line").with_settings(same) == line


@pytest.mark.parametrize("rung", train_grasp.RUNGS)
def test_every_cell_of_every_rung_keeps_the_estimator_of_the_rung(rung):
    for cell in set(train_grasp.CELLS) - set(DETECTOR_CELLS if rung == "train:guided" else ()):
        scenario = scenario_of(rung, cell)
        assert scenario.name == rung and scenario.seed == 7
        assert scenario.estimator == load_scenario(rung).estimator
        assert snake_case(type(scenario.estimator).__name__) == train_grasp.RUNGS[rung]

    for cell in DETECTOR_CELLS if rung == "train:guided" else ():
        with pytest.raises(DrakeTrackerError, match=r"no setting vision.method.detector in !SilhouetteTracker"):
            scenario_of(rung, cell)


@pytest.mark.parametrize("name, estimator", [*train_grasp.RUNGS.items(), *train_grasp.OTHERS.items()])
def test_a_scenario_as_it_is_has_its_own_settings_and_the_named_estimator(name, estimator):
    scenario = scenario_of(name, train_grasp.ITSELF, estimator)
    assert scenario == load_scenario(name, seed=7)
    assert snake_case(type(scenario.estimator).__name__) == estimator


def test_another_estimator_and_overrides_of_the_user_come_last():
    scenario = scenario_of("train", "oval-0.10", "alpha_beta_gamma", ["track.speed=0.12"])
    assert snake_case(type(scenario.estimator).__name__) == "alpha_beta_gamma" and scenario.track.speed == 0.12


def test_the_cells_of_the_paper_are_its_tracks_and_speeds():
    cells = [scenario_of("train", cell).track for cell in train_grasp.PAPER_CELLS]
    assert {(track.kind, track.speed) for track in cells} == {
        (kind, speed) for kind in ("oval", "stadium", "circle") for speed in (0.10, 0.15, 0.20)
    }
