import numpy as np
import pytest

from drake_tracker.calibration.rendered_boards import board_for, calibrate, calibrate_cameras, calibration_error
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.imaging.cameras import describe_rig, true_camera_models

VOLUME = ((0.30, -0.34, 0.45), (0.82, 0.34, 0.53))


def rms(errors):
    return np.sqrt((errors**2).sum(axis=1).mean())


def test_a_moved_camera_is_recovered_from_images_alone():
    moved = CamerasConfig(azimuth_deg=[63.0, -45.0], distance=1.25)
    results = calibrate_cameras(moved, LightingConfig(), table_height=0.45, lens_views=8, seed=5)
    models = {name: result.model for name, result in results.items()}
    errors = calibration_error(models, true_camera_models(moved), VOLUME)
    assert len(errors) > 80
    assert rms(errors) <= 0.0015
    # The old pose does not fit.
    assert rms(calibration_error(models, true_camera_models(CamerasConfig()), VOLUME)) > 0.05


def test_the_error_is_that_of_the_models():
    truth = true_camera_models(CamerasConfig())
    assert rms(calibration_error(truth, truth, VOLUME)) < 1e-9
    shift = np.eye(4)
    shift[:3, 3] = [-0.003, 0.004, 0.0]
    shifted = {name: CameraModel(m.K, m.distortion, m.X_CW @ shift, m.width, m.height) for name, m in truth.items()}
    errors = calibration_error(shifted, truth, VOLUME)
    np.testing.assert_allclose(errors, np.tile([0.003, -0.004, 0.0], (129, 1)), atol=1e-9)


def test_the_command_writes_a_file_that_loads(tmp_path, capsys):
    scenario = TrainScenario(cameras=CamerasConfig(width=192, height=192, fov_deg=20.0, noise=1.0))
    path = tmp_path / "cameras.yaml"
    models = calibrate(scenario, path)
    assert "3-D error against truth over the work volume: 0." in capsys.readouterr().out
    loaded = load_calibration(path, rig=describe_rig(scenario.cameras))
    for name, model in models.items():
        np.testing.assert_allclose(loaded[name].X_CW, model.X_CW, atol=1e-8)


def test_cameras_that_do_not_see_the_work_volume_are_refused_before_anything_is_rendered(tmp_path, monkeypatch):
    monkeypatch.setattr("drake_tracker.calibration.rendered_boards.calibrate_cameras", None)
    scenario = TrainScenario(cameras=CamerasConfig(look_at=[0.4, 2.0, 0.47], distance=1.0))
    with pytest.raises(DrakeTrackerError, match="cameras.look_at .* is in view of both cameras"):
        calibrate(scenario, tmp_path / "cameras.yaml")
    with pytest.raises(DrakeTrackerError, match="must be a file in a folder that exists"):
        calibrate(TrainScenario(), tmp_path / "none" / "cameras.yaml")


@pytest.mark.parametrize("name", ["train", "train:interlaced"])
def test_the_packages_files_are_within_a_millimetre(name):
    from drake_tracker.tasks import load_scenario, scenario_file

    cameras = load_scenario(name).cameras
    models = load_calibration(scenario_file(cameras.calibration), rig=describe_rig(cameras))
    assert rms(calibration_error(models, true_camera_models(cameras), VOLUME)) < 0.001


def test_the_board_suits_the_field():
    assert board_for(CamerasConfig()).square == 0.045
    assert board_for(CamerasConfig(fov_deg=17.0)).square == 0.025
