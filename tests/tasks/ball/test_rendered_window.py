"""The part of the image that a run of the ball renders, and the photographs of its board."""

import numpy as np
import pytest
from ball_scenario import make_scenario, true_poses
from pydrake.systems.analysis import Simulator

from drake_tracker.core.messages import TrackPoint
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.config import CatchConfig
from drake_tracker.tasks.ball.initialisation import CIRCLE_IMAGES, make_touching_diagram, photograph_board
from drake_tracker.tasks.ball.setup import resolve
from drake_tracker.tasks.filming import HAND_BORDER
from drake_tracker.tasks.registry import make_diagram
from drake_tracker.world.ball import ball_world_diagram

SEED = 3
FULL = {"camera.render_window": False}


def test_the_board_and_the_hand_are_in_the_window():
    for seed in range(20):
        scenario = make_scenario(seed=seed)
        poses = true_poses(scenario)
        u0, v0, width, height = resolve(scenario, poses).window
        board = resolve(scenario, poses).search_window
        low = np.clip(board.polygon.min(axis=0) - HAND_BORDER, 0, 256)
        high = np.clip(board.polygon.max(axis=0) + HAND_BORDER, 0, 256)
        assert (np.array([u0, v0]) <= np.floor(low) + 1).all()
        assert (np.array([u0 + width, v0 + height]) >= np.floor(high)).all()
        assert resolve(scenario.with_settings(FULL), poses).window == (0, 0, 256, 256)


def rolling_ball(settings, monkeypatch):
    """Points on the board while a ball rolls, and an image, with its place in the full image."""
    monkeypatch.setattr(ball_world_diagram, "draw_delay", lambda seed: 0.2)  # each image before the release costs time
    monkeypatch.setattr(CatchConfig, "home_duration", 0.2)
    settings = {"camera.render_processes": "0", "catch.ready_after": 0.0, **settings}
    scenario = make_scenario(seed=SEED, noise=2.0).with_settings(settings)
    poses = true_poses(scenario)
    hand_eye = make_diagram(scenario, poses)
    simulator = Simulator(hand_eye)
    points = []
    for cycle in range(10, 70, 2):
        simulator.AdvanceTo(cycle * VISION_PERIOD + 0.01)
        points.append(np.array(hand_eye.GetOutputPort("point").Eval(simulator.get_context())))
    image = np.array(hand_eye.GetOutputPort("camera").Eval(simulator.get_context()).data)
    return points, image, resolve(scenario, poses).window


def test_through_the_window_the_ball_is_seen_as_in_the_full_image(monkeypatch):
    full, full_image, _ = rolling_ball(FULL, monkeypatch)
    cropped, image, (u0, v0, width, height) = rolling_ball({}, monkeypatch)
    assert image.shape == (height, width, 4) and width * height < 0.7 * 256 * 256
    difference = full_image[v0 : v0 + height, u0 : u0 + width].astype(int) - image
    assert np.count_nonzero(difference.any(axis=2)) < 0.01 * width * height, "only single pixels differ"
    seen = [(TrackPoint(a), TrackPoint(b)) for a, b in zip(full, cropped)]
    assert [a.valid for a, _ in seen] == [b.valid for _, b in seen]
    offsets = [np.hypot(a.x - b.x, a.y - b.y) for a, b in seen if a.valid]
    assert len(offsets) > 10 and max(offsets) < 0.002


@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_each_photograph_of_the_board_has_its_own_noise(noise):
    scenario = make_scenario(seed=SEED, noise=noise)
    scenario = scenario.with_settings({"lighting.flicker": 0.0})
    touching = make_touching_diagram(scenario)
    images = photograph_board(touching, touching.CreateDefaultContext())
    assert len(images) == CIRCLE_IMAGES and images[0].shape == (256, 256, 3) and images[0].std() > 20
    for image in images[1:]:
        difference = image.astype(int) - images[0]
        if noise == 0.0:
            assert not difference.any()
        else:
            assert np.std(difference) == pytest.approx(2**0.5 * noise, rel=0.1)
