import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_tracker.calibration import wrist_boards
from drake_tracker.calibration.wrist_boards import calibrate_wrist, find_wrist_camera
from drake_tracker.cameras.boards.board_poses import pose_error
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks import load_scenario
from drake_tracker.world.imaging.wrist_camera import true_wrist_model


def test_rendered_boards_calibrate_the_camera_on_the_hand(monkeypatch):
    monkeypatch.setattr(wrist_boards, "VIEWS", 8)
    scenario = load_scenario("train:wrist")
    result = find_wrist_camera(scenario, scenario.cameras.wrist)
    truth = true_wrist_model(scenario.cameras.wrist)
    distance, turn = pose_error(RigidTransform(result.model.X_WC), RigidTransform(truth.X_WC))
    assert result.views == 8 and result.pose_rms < 0.3
    assert distance < 0.003 and np.rad2deg(turn) < 0.3
    assert result.model.K[0, 0] == pytest.approx(truth.K[0, 0], rel=0.01)


def test_a_hand_without_a_camera_cannot_be_calibrated(tmp_path):
    with pytest.raises(DrakeTrackerError, match=r"cameras.wrist.*must be !WristCamera"):
        calibrate_wrist(load_scenario("train:learned"), tmp_path / "wrist.yaml")
