"""Colours of trains, table and objects in rendered images, in this process and beside it."""

import cv2
import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_tracker import DrakeTrackerError, load_scenario
from drake_tracker.core.colour import rgb
from drake_tracker.core.models_path import models_path
from drake_tracker.tasks.train.diagram import make_world
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world import painted_mesh
from drake_tracker.world.config import TRAIN_BODIES
from drake_tracker.world.imaging.cameras import CAMERA_NAMES
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.train.train_model import PAINTED_CELLS
from models import mesh_builder
from models.train.make_meshes import PALETTE

LATENCY = 2
LOOKS = [
    "train.colour='#20c040'",
    "table_colour='#6070a0'",
    "objects=[!Ball {colour: '#d02020'}, !Train {body: plain, colour: '#e020e0'}]",
]


@pytest.fixture(scope="module")
def reach():
    return resolve(load_scenario("train:learned")).reach


def images_of(reach, overrides, pipeline=None):
    """The images of both cameras at time 0, RGB, without noise."""
    scenario = load_scenario("train:learned", overrides=["cameras.noise=0.0", *overrides])
    world = make_world(resolve(scenario), pipeline=pipeline)
    simulator = Simulator(world)
    context = simulator.get_mutable_context()
    world.GetInputPort("arm_desired_state").FixValue(context, [*reach.q_initial, *np.zeros(6)])
    world.GetInputPort("arm_feedforward").FixValue(context, np.zeros(6))
    world.GetInputPort("gripper_desired_state").FixValue(context, [0.044, 0.0])
    if pipeline is not None:
        simulator.AdvanceTo((LATENCY + 0.5) / 60.0)
    images = [world.GetOutputPort(name).Eval(context).data[..., :3].astype(int) for name in CAMERA_NAMES]
    world.close()
    return images


def count(image, *, over, under):
    """Number of pixels in which the channels ``over`` exceed the channels ``under`` by 60 grey levels."""
    return int(np.sum(image[..., over].min(axis=-1) - image[..., under].max(axis=-1) > 60))


@pytest.fixture(scope="module")
def coloured(reach):
    return images_of(reach, LOOKS)


RED, GREEN, BLUE = [0], [1], [2]


def test_all_colours_are_in_both_images(reach, coloured):
    for plain, image in zip(images_of(reach, []), coloured):
        for over, under in ((GREEN, [0, 2]), (RED, [1, 2]), ([0, 2], GREEN)):
            assert count(image, over=over, under=under) > count(plain, over=over, under=under) + 40
        corner = np.median(image[100:128, 5:60].reshape(-1, 3), axis=0)
        assert corner[2] > 1.3 * corner[0], "the table is blue"
        before = np.median(plain[100:128, 5:60].reshape(-1, 3), axis=0)
        assert before[0] > before[2]


def test_processes_beside_the_simulation_make_the_same_images(reach, coloured):
    beside = images_of(reach, LOOKS, ImagePipeline(LATENCY, 1))
    assert all(np.array_equal(a, b) for a, b in zip(beside, coloured))


def test_colours_are_in_images_with_shadows(reach):
    for image in images_of(reach, [*LOOKS, "lighting.shadows=true"]):
        assert count(image, over=GREEN, under=[0, 2]) > 40
        assert count(image, over=[0, 2], under=GREEN) > 40


def test_the_painted_cells_are_the_main_colours_of_the_models():
    names = list(PALETTE)
    painted = {body: [names[cell] for cell in cells] for body, cells in PAINTED_CELLS.items()}
    assert painted == {
        "plain": ["yellow", "cream"],
        "striped": ["white"],
        "round": ["red"],
        "dark": ["coal"],
        "cube": ["red"],
    }
    assert painted_mesh.CELL == mesh_builder.CELL


def test_a_stain_keeps_the_grain_and_changes_the_mean():
    wood = cv2.imread(str(models_path() / "table" / "wood.png"))
    stained = painted_mesh.stain(rgb("#406080"))(wood)
    assert stained.reshape(-1, 3).mean(axis=0) == pytest.approx([0x80, 0x60, 0x40], rel=0.02)
    assert np.corrcoef(wood.mean(axis=2).ravel(), stained.mean(axis=2).ravel())[0, 1] > 0.98


@pytest.mark.parametrize("body", TRAIN_BODIES)
def test_every_train_can_be_painted(reach, body):
    image = images_of(reach, [f"train.body={body}", "train.colour='#20c040'"])[0]
    assert count(image, over=GREEN, under=[0, 2]) > 40


@pytest.mark.parametrize(
    "override, message",
    [
        ("train.colour=red", "train.colour must be #rrggbb with hexadecimal digits, or empty, not 'red'"),
        ("table_colour='#12345'", "table_colour must be #rrggbb with hexadecimal digits, or empty, not '#12345'"),
        ("objects=[!Ball {colour: ''}]", "objects[0].colour must be #rrggbb with hexadecimal digits, not ''"),
        ("objects=[!Hand {}, !Train {colour: '#zzzzzz'}]", "objects[1].colour must be #rrggbb"),
        ("objects=[!Train {track: {kind: csv}}]", "objects[0].track.kind must not be csv"),
        ("objects=[!Train {track: {start: -0.5}}]", "objects[0].track.start must be -1"),
        ("objects=[!Horse {}]", "objects[0] must be one of !Train, !Ball, !Hand, not !Horse"),
        ("train.scale=2.0", "train.scale must be a number from 0.5 to 1.5, not 2.0"),
    ],
)
def test_a_wrong_setting_gives_one_line_that_names_it(override, message):
    with pytest.raises(DrakeTrackerError) as caught:
        load_scenario("train:learned", overrides=[override])
    assert message in str(caught.value) and "\n" not in str(caught.value)
    assert str(caught.value).startswith("--set ")
