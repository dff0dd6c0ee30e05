import numpy as np
import pytest
from ball_scenario import make_scenario
from pydrake.math import RigidTransform

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.ball.ball_board import CIRCLE_RADIUS, CIRCLES, draw_board_pose, face_corners
from drake_tracker.world.ball.ball_board_visual import WALL_HEIGHT
from drake_tracker.world.ball.ball_camera import MARGIN, clears_walls, draw_camera_pose
from drake_tracker.world.imaging.cameras import true_camera_model

SCENARIO = make_scenario()


def draw(seed, scenario=SCENARIO):
    X_WB = draw_board_pose(scenario.board, seed)
    return X_WB, draw_camera_pose(scenario.camera, board=scenario.board, X_WB=X_WB, seed=seed)


@pytest.mark.parametrize("seed", range(0, 100, 5))
def test_the_whole_face_is_in_view(seed):
    X_WB, X_WC = draw(seed)
    pixels = true_camera_model(SCENARIO.camera, X_WC).project(X_WB.multiply(face_corners(SCENARIO.board).T).T)
    assert np.all(pixels >= MARGIN) and np.all(pixels <= 255 - MARGIN)
    assert draw(seed)[1].IsExactlyEqualTo(X_WC)


def test_places_fill_their_ranges():
    azimuth, elevation, distance, roll = [], [], [], []
    for seed in range(200):
        X_WB, X_WC = draw(seed)
        towards = X_WC.translation() - X_WB @ face_corners(SCENARIO.board).mean(axis=0)
        distance.append(np.linalg.norm(towards))
        azimuth.append(np.rad2deg(np.arctan2(towards[1], towards[0])))
        elevation.append(np.rad2deg(np.arcsin(towards[2] / distance[-1])))
        roll.append(np.rad2deg(np.arcsin(X_WC.rotation().matrix()[2, 0] / np.cos(np.deg2rad(elevation[-1])))))
    for values, low, high in (
        (azimuth, -50, 50), (elevation, 40, 65), (distance, 1.5, 1.9), (roll, -5, 5)
    ):  # fmt: skip
        assert low <= min(values) < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < max(values) <= high


def test_circles_do_not_hide_behind_walls():
    """The sight of a circle's outer edge grazes the wall exactly where `clears_walls` says no longer."""
    outer = max(abs(x) for x, _ in CIRCLES) + CIRCLE_RADIUS
    slope = WALL_HEIGHT / (0.5 * SCENARIO.board.width - outer)
    for x in (-1.2, 1.2):
        height = slope * (abs(x) - outer)
        assert clears_walls(np.array([x, 0.4, height + 0.001]), SCENARIO.board)
        assert not clears_walls(np.array([x, 0.4, height - 0.001]), SCENARIO.board)
    assert clears_walls(np.array([0.1, 0.4, 0.1]), SCENARIO.board)
    for seed in range(50):
        X_WB, X_WC = draw(seed)
        assert clears_walls(X_WB.inverse() @ X_WC.translation(), SCENARIO.board)


def test_a_lens_too_long_is_refused():
    scenario = make_scenario().with_settings({"camera.fov_deg": 20.0})
    with pytest.raises(DrakeTrackerError, match="camera.fov_deg"):
        draw_camera_pose(scenario.camera, board=scenario.board, X_WB=RigidTransform(), seed=0)
