"""Trials on the cores of this machine."""

import os

import pytest

from drake_tracker.campaign import pool as pool_module
from drake_tracker.campaign.plan import make_plan
from drake_tracker.campaign.pool import pool
from drake_tracker.campaign.run import chooses_rendering
from drake_tracker.world.imaging.image_pipeline import VARIABLE

NAMES = (VARIABLE, "LP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")


def variables(job):
    return [os.environ.get(name) for name in NAMES]


@pytest.mark.parametrize(
    ("processors", "variable", "expected"), [(1, None, "0"), (1, "2", "2"), (4, None, None), (4, "1", "1")]
)
def test_trials_render_beside_the_simulation_only_on_spare_processors(monkeypatch, processors, variable, expected):
    monkeypatch.setattr(pool_module, "processors", lambda: processors)
    monkeypatch.delenv(VARIABLE, raising=False)
    for name in NAMES[1:]:
        monkeypatch.delenv(name, raising=False)
    if variable:
        monkeypatch.setenv(VARIABLE, variable)
    ((_, found),) = pool(2)(variables, [1])
    assert found == [expected, "1", "1", "1"]
    assert os.environ.get(VARIABLE) == variable and "LP_NUM_THREADS" not in os.environ


def test_a_campaign_says_where_it_renders_only_if_that_was_its_choice(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    plans = [
        make_plan("train:learned", 1),
        make_plan("ball", 1),
        make_plan("train:learned", 1, vision="measured"),
        make_plan("train:learned", 1, overrides=["cameras.render_processes=1"]),
        make_plan("ball", 1, overrides=["camera.render_processes=0"]),
    ]
    assert [chooses_rendering(plan) for plan in plans] == [True, True, False, False, False]
    monkeypatch.setenv(VARIABLE, "0")
    assert not chooses_rendering(plans[0])
