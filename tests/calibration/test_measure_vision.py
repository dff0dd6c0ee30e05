"""From the camera loop to a file of its error, and a closed loop that runs on it."""

import numpy as np
import pytest

from drake_tracker import cli, load_scenario, make_diagram, simulate
from drake_tracker.calibration.measure_vision import bias_over_headings, check_request, pixel_footprint, sightings_of
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal, load_log
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.measured_error_file import load_error
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks import load_scenario as load
from drake_tracker.tasks import save_scenario, scenario_file
from drake_tracker.tasks.train.scenario import Measured, Rendered, TrainScenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import describe_rig

MEASURED = "vision=!Measured {}"


def test_the_tag_chooses_the_kind_and_survives_a_file(tmp_path):
    assert type(load("train:learned").vision) is Rendered
    scenario = load("train:learned", overrides=[MEASURED, "vision.lag_cycles=6"])
    assert type(scenario.vision) is Measured and scenario.vision.lag_cycles == 6
    save_scenario(scenario, tmp_path / "mine.yaml")
    again = load(str(tmp_path / "mine.yaml"))
    assert again.vision == scenario.vision


@pytest.mark.parametrize(
    "overrides, said",
    [
        (["vision=!Measured {file: none.yaml}"], "vision.file: there is no file"),
        (["vision=!Measured {detector: {}}"], "there is no setting vision.detector"),
        (["vision=!Measured {lag_cycles: -1}"], "a whole number from 0 to 120"),
        ([MEASURED, "cameras.fov_deg=20"], "made with rig.fov_deg = 30.0"),
        ([MEASURED, "track.speed=0.001"], "the measured vision sees nothing below"),
    ],
)
def test_unusable_settings_give_a_message_of_one_line(overrides, said):
    with pytest.raises(DrakeTrackerError) as caught:
        make_diagram(load("train:learned", overrides=overrides))
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_the_packages_file_is_for_the_default_cameras_and_says_what_they_are_like():
    error = load_error(scenario_file("train_vision.yaml"), rig=describe_rig(TrainScenario().cameras))
    assert error.speeds[0] <= 0.05 and error.speeds[-1] >= 0.6
    assert 0.0 < error.seen_from < error.speeds[0]
    assert error.pixel == pytest.approx(pixel_footprint(CamerasConfig()), rel=1e-4)
    assert np.all(np.abs(error.bias[:, 0]) < 0.012)
    size = np.sqrt(error.pattern**2 + np.sum(error.jitter**2, axis=2))
    assert np.all((size > 1e-4) & (size < 4e-3))


def test_rms_and_mean_of_a_bias_over_all_headings():
    headings = np.radians(np.arange(0.0, 360.0, 15.0))
    bias = np.zeros((2, 24, 3))
    bias[0, :, 0] = -2e-3
    bias[0, :, 1] = 3e-3 * np.sin(headings)  # to the left; what a bend adds is towards its inside
    bias[1, :, 1] = 1e-4
    rms, mean = bias_over_headings(bias, radius=0.1)
    swing = 3e-3 / np.sqrt(2.0)
    assert mean == pytest.approx([-2e-3, 0.0, 0.0, 1e-3], abs=1e-12)
    assert rms == pytest.approx([2e-3, swing, 0.0, np.hypot(swing, 1e-3)])


def test_without_cameras_there_are_no_images_and_nothing_to_render_with():
    hand_eye = make_diagram(load("train:learned", overrides=[MEASURED]))
    assert hand_eye.world.cameras == {}
    assert not hand_eye.world.laboratory.scene_graph.RendererCount()
    names = {hand_eye.get_output_port(k).get_name() for k in range(hand_eye.num_output_ports())}
    assert "point" in names and not [name for name in names if "camera" in name or "centroid" in name]


def test_the_hand_lifts_the_train_on_measured_vision(tmp_path):
    scenario = load_scenario("train:learned", seed=1, overrides=[MEASURED, "track.speed=0.2"])
    summary = simulate(scenario, tmp_path, RunOptions(record=False))
    assert summary["success"], summary["failure_reason"]
    assert summary["lag_s"]["min"] == pytest.approx(0.250833, abs=1e-6) == summary["lag_s"]["max"]
    assert 0.0005 < summary["triangulation_jitter_m"] < 0.003 and summary["triangulation_rms_m"] < 0.006
    log = load_log(tmp_path / "log.npz")
    assert "centroid_left" not in log and "point" in log
    assert (tmp_path / "tracking.png").stat().st_size > 10_000


def test_a_recording_has_no_camera_video(tmp_path):
    scenario = load_scenario("train:learned", seed=1, duration=0.2, overrides=[MEASURED])
    simulate(scenario, out=tmp_path)
    found = {path.name for path in tmp_path.iterdir()}
    assert "recording.html" in found and not {"cameras.mp4", "motion.png"} & found


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("-o none/x.yaml", "-o none/x.yaml: must be a file in a folder that exists"),
        ("-o x.yaml --seeds 0", "--seeds 0: must be from 1 to 100"),
        ("-o x.yaml --laps 0", "--laps 0: must be 1 or more"),
        ("-o x.yaml --speeds fast", "--speeds fast: must be numbers separated by commas"),
        ("-o x.yaml --speeds 0.1,0.1", "must be different numbers"),
        ("-o x.yaml --set vision=!Measured", "must be !Rendered"),
        (
            "-o x.yaml --set vision.method=!SilhouetteTracker",
            "vision.method=!SilhouetteTracker: vision.method must be !MotionCentroid",
        ),
    ],
)
def test_bad_requests_give_a_message_of_one_line(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["measure", "train:learned", *arguments.split()]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line and list(tmp_path.iterdir()) == []


def test_a_good_request_is_accepted(tmp_path):
    check_request(load("train:learned"), tmp_path / "x.yaml", 2, 2, (0.1, 0.2))


def test_sightings_are_errors_at_the_stamp_along_and_across():
    times = VISION_PERIOD * np.arange(240)
    truth = np.zeros((240, 13))
    truth[:, 0], truth[:, 4], truth[:, 5], truth[:, 6] = np.cos(np.pi / 4), 0.5, 0.1 * times, 0.485
    truth[:, 3], truth[:, 11] = np.sin(np.pi / 4), 0.1  # heads along y
    names = ("qw", "qx", "qy", "qz", "x", "y", "z", "wx", "wy", "wz", "vx", "vy", "vz")
    stamps = np.maximum(times - 0.25, 0.0)
    point = np.column_stack([stamps, 0.5 + 0 * times, 0.1 * stamps + 0.003, 0.484 + 0 * times, 0 * times, times > 0])
    point[200, -1] = 0.0
    log = {
        "truth_train_state": Signal(times, truth, names),
        "point": Signal(times, point, ("stamp", "x", "y", "z", "gap", "valid")),
    }
    (found,) = sightings_of(log, 0.1)
    seen = np.isfinite(found.error).all(axis=1)
    assert np.count_nonzero(~seen) == 1
    assert found.error[seen] == pytest.approx(np.tile([0.003, 0.0, -0.001], (seen.sum(), 1)), abs=1e-9)
    assert found.yaw == pytest.approx(np.full(len(found.yaw), np.pi / 2))


def test_the_footprint_of_a_pixel_is_that_of_the_calibrated_camera():
    scenario = load("train:learned")
    camera = resolve(scenario).cameras["left"]
    look_at = np.array(scenario.cameras.look_at)
    beside = look_at + [0.0, 0.0, 0.01 / np.cos(np.deg2rad(scenario.cameras.elevation_deg))]
    pixels = np.linalg.norm(camera.project(beside[None]) - camera.project(look_at[None]))
    assert 0.01 / pixels == pytest.approx(pixel_footprint(scenario.cameras), rel=0.05)
