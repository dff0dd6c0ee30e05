"""Tests of settings that are allowed one by one, but make no sense together."""

import re

import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.models_path import models_path
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.plausible import BYTES_AHEAD, BYTES_PER_PIXEL, MOST_IMAGE_MEMORY
from drake_tracker.tasks.train.scenario import grasp_of
from drake_tracker.world.config import CUBE_EDGE, TRAIN_BODIES, TRAIN_WIDTH, body_size

LARGE = ("camera.width=2048", "camera.height=2048")
NARROW = "leaves the jaws too narrow: they open to 0.044 m, and an object of 0.04 m needs 0.05 m"
LATE = "lets packets arrive too late: a packet predicts 1.5 s from its image on, of which vision takes"
NO_TIME = "leaves no time for a grasp: a packet predicts 1.5 s from its image on, of which vision takes"


@pytest.mark.parametrize(
    ("name", "overrides", "message"),
    [
        ("train", ["grasp.jaw_opening=0.044"], f"jaw_opening=0.044: grasp.jaw_opening {NARROW}"),
        ("train", ["grasp.jaw_opening=0.044", "grasp.object_width=0.02"], NARROW),
        ("train", ["grasp.object_width=0.085"], "grasp.object_width leaves the jaws too narrow: they open to 0.088 m"),
        ("train", ["grasp.object_width=0.01"], "must be above 0.01 m, or jaws that closed on nothing would count"),
        (
            "train",
            ["grasp.closing_lead=0.3", "grasp.descent_duration=0.25"],
            "grasp.closing_lead lets the jaws close before the descent begins: grasp.closing_lead is 0.3 s",
        ),
        ("train", ["grasp.descent_duration=0.2", "grasp.closing_lead=0.21"], "lets the jaws close before"),
        ("train", ["grasp.lift_height=0.1"], "must be at least 0.109 m: the object counts as lifted from 0.1 m"),
        ("train", ["grasp.lift_height=0.108"], "must be at least 0.109 m"),
        ("train", ["grasp.descent_duration=1.25"], f"descent_duration {NO_TIME} 0.25 s, descent and closing 1.31 s"),
        ("train", ["vision.lag_cycles=70"], f"vision.lag_cycles {NO_TIME} 1.17 s, descent and closing 0.42 s"),
        ("train", ["link=!Lossy {delay: 5}"], f"link.delay {LATE} 0.25 s and the link up to 5 s (delay and jitter)"),
        ("train", ["link=!Lossy {delay: 0.5, jitter: 0.75}"], f"link.delay {LATE} 0.25 s and the link up to 1.25 s"),
        ("train", ["vision.lag_cycles=90"], f"vision.lag_cycles {LATE} 1.5 s and the link up to 0 s"),
        ("ball", ["link=!Lossy {jitter: 1.4}"], f"link.jitter {LATE} 0.1 s and the link up to 1.4 s"),
        ("ball", ["vision.throughput_cycles=30"], "leaves no prediction to trust: each is 0.5 s old when it arrives"),
    ],
)
def test_nonsense_gives_one_line_that_states_what_contradicts_what(name, overrides, message):
    with pytest.raises(DrakeTrackerError) as caught:
        load_scenario(name, overrides=overrides)
    (line,) = str(caught.value).splitlines()
    assert line.startswith("--set ") and message in line


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("train", ["grasp.jaw_opening=0.05"]),
        ("train", ["grasp.closing_lead=0.3", "grasp.descent_duration=0.3"]),
        ("train", ["grasp.lift_height=0.11"]),
        ("train", ["link=!Lossy {delay: 1.2}"]),  # too late for a grasp, but the hand can follow
        ("train", ["vision.lag_cycles=60"]),
        ("train", ["cameras.width=2048", "cameras.height=2048"]),
        ("ball", [*LARGE, "camera.supersampling=4"]),
        ("ball", ["camera.supersampling=8"]),
        ("ball", ["link=!Lossy {delay: 0.5}"]),
    ],
)
def test_what_is_unusual_but_possible_is_allowed(name, overrides):
    load_scenario(name, overrides=overrides)


def test_images_that_need_too_much_memory_are_refused_with_the_memory_that_they_need():
    with pytest.raises(DrakeTrackerError) as caught:
        load_scenario("ball", overrides=[*LARGE, "camera.supersampling=8"])
    needed, most = 2048 * 2048 * (64 * BYTES_PER_PIXEL + BYTES_AHEAD) / 2**30, MOST_IMAGE_MEMORY / 2**30
    assert str(caught.value) == (
        "--set camera.supersampling=8: camera.supersampling must be smaller: 2048 x 2048 px with 8 x 8 rendered pixels "
        f"each need {needed:.1f} GiB of memory (268 million rendered pixels); at most {most:g} GiB are allowed"
    )


def test_the_width_of_the_train_is_that_of_its_models():
    for body in TRAIN_BODIES:
        text = (models_path() / "train" / f"train_{body}.sdf").read_text()
        size = tuple(map(float, re.search(r"<size>(.*)</size>", text)[1].split()))
        assert size == body_size(body, 1.0), body
        assert size[1] == (CUBE_EDGE if body == "cube" else TRAIN_WIDTH), body


def test_width_and_reach_of_the_grasp_follow_from_the_body():
    for body, scale, width, reach in (
        ("plain", 1.5, 0.040, 0.090),
        ("cube", 1.0, 0.030, 0.015),
        ("cube", 1.5, 0.045, 0.0225),
    ):
        grasp = grasp_of(load_scenario("train", overrides=[f"train.body={body}", f"train.scale={scale}"]))
        assert (grasp.object_width, grasp.reach) == pytest.approx((width, reach))
    own = load_scenario("train", overrides=["train.body=cube", "train.scale=1.5", "grasp.object_width=0.028"])
    assert grasp_of(own).object_width == 0.028
