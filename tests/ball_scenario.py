"""The ball's scenario with a few of its settings changed: a camera without noise unless told otherwise."""

import numpy as np

from drake_tracker.cameras.boards.board_poses import BoardPoses
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.world.ball.ball_board import draw_board_pose
from drake_tracker.world.ball.ball_camera import draw_camera_pose


def make_scenario(seed=0, noise=0.0, start_x=None, release=True, **board):
    changes = {"camera.noise": noise, "ball.start_x": start_x, "ball.release": release}
    return BallScenario(seed=seed).with_settings(changes | {f"board.{key}": value for key, value in board.items()})


def true_poses(scenario):
    """The board's poses as they are, in the place of those that `initialise_board` finds."""
    X_WB = draw_board_pose(scenario.board, scenario.seed)
    X_WC = draw_camera_pose(scenario.camera, board=scenario.board, X_WB=X_WB, seed=scenario.seed)
    size = (scenario.camera.height, scenario.camera.width, 3)
    nothing = np.zeros((3, 3)), np.zeros(size, np.uint8), np.zeros((4, 2))
    return BoardPoses(X_WC.inverse() @ X_WB, X_WB, 0.0, *nothing)
