"""The MCAP file of a track, read back by the readers of the format."""

import sys

import cv2
import numpy as np
import pytest
from films import CAMERAS, film, read_track, write_calibration, write_video
from mcap_messages import numbers_of, points_of, read_mcap
from scipy.spatial.transform import Rotation

from drake_tracker import cli
from drake_tracker.core.files.mcap_file import McapFile

TIMES = np.arange(40) / 30.0


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mcap")
    write_calibration(folder / "stereo.yaml")
    for side in ("left", "right"):
        write_video(folder / f"{side}.mkv", film(side, TIMES), TIMES)
    sources = [str(folder / f"{side}.mkv") for side in ("left", "right")]
    options = ["--calibration", str(folder / "stereo.yaml"), "--no-overlay", "--mcap"]
    assert cli.main(["track", *sources, *options, "--out", str(folder / "out")]) == 0
    assert cli.main(["track", sources[0], "--no-overlay", "--mcap", "--out", str(folder / "single")]) == 0
    return folder


@pytest.fixture(scope="module")
def topics(tracked):
    return read_mcap(tracked / "out" / "track.mcap")


def test_each_image_is_there_at_its_stamp(topics):
    for side in ("left", "right"):
        times = [time for time, _ in topics[f"/camera_{side}/image"]]
        np.testing.assert_allclose(times, TIMES, atol=1e-3)
        _, image = topics[f"/camera_{side}/image"][20]
        grey = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_GRAYSCALE)
        assert np.abs(grey.astype(float) - film(side, TIMES[:21])[-1]).mean() < 3.0


def test_cameras_and_their_frames_are_those_of_the_calibration(topics):
    frames = {t.child_frame_id: t for _, each in topics["/tf"] for t in each.transforms}
    for name, camera in CAMERAS.items():
        (_, calibration), *_ = topics[f"/{name}/calibration"]
        np.testing.assert_allclose(np.reshape(calibration.K, (3, 3)), camera.K)
        turn, p = frames[name].rotation, frames[name].translation
        X = camera.X_WC
        np.testing.assert_allclose([p.x, p.y, p.z], X[:3, 3], atol=1e-6)
        np.testing.assert_allclose(
            Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix(), X[:3, :3], atol=1e-6
        )


@pytest.mark.parametrize(("count", "model"), [(4, "kannala_brandt"), (5, "plumb_bob"), (8, "rational_polynomial")])
def test_each_lens_has_the_name_of_the_schema(tmp_path, count, model):
    """foxglove.CameraCalibration lists the models with their coefficients; four are those of OpenCV's fisheye."""
    file = McapFile(tmp_path / "lens.mcap")
    distortion = np.linspace(0.01, 0.08, count)
    file.calibration("/camera", 0.0, "camera", (640, 480), CAMERAS["camera_left"].K, distortion)
    file.close()
    ((_, calibration),) = read_mcap(tmp_path / "lens.mcap")["/camera"]
    assert calibration.distortion_model == model
    np.testing.assert_allclose(calibration.D, distortion)


def test_points_paths_and_numbers_are_those_of_the_table(tracked, topics):
    data = read_track(tracked / "out")
    valid = data["valid"] > 0
    points = topics["/point"]
    np.testing.assert_allclose([time for time, _ in points], data["stamp"][valid], atol=1e-5)
    shown = np.vstack([points_of(each) for _, each in points])
    np.testing.assert_allclose(shown, np.column_stack([data[name][valid] for name in "xyz"]), atol=1e-6)
    predicted = np.isfinite(data["predicted_x"])
    paths = dict(topics["/prediction"])
    assert len(paths) == predicted.sum() > 20
    path = topics["/prediction"][-1][1].poses  # 50 ms apart
    np.testing.assert_allclose(path[5].position.x, data["predicted_x"][predicted][-1], atol=1e-5)
    np.testing.assert_array_equal(points_of(topics["/prediction/points"][-1][1])[5, 0], path[5].position.x)
    numbers = numbers_of(topics["/signals/camera_left/centroid"][-1][1])
    assert numbers["u"] == pytest.approx(data["left_u"][-1], abs=1e-5)
    circle = topics["/camera_right/marks"][-1][1].circles[0]
    assert circle.position.x == pytest.approx(data["right_u"][np.isfinite(data["right_u"])][-1], abs=1e-5)


def test_an_uncalibrated_camera_has_its_path_in_the_image(tracked):
    topics = read_mcap(tracked / "single" / "track.mcap")
    assert set(topics) == {
        "/camera_left/image", "/camera_left/marks", "/camera_left/path",
        "/signals/camera_left/centroid", "/signals/filtered",
    }  # fmt: skip
    data = read_track(tracked / "single")
    known = np.isfinite(data["filtered_u"])
    lines = topics["/camera_left/path"]
    assert len(lines) == known.sum() > 20
    assert lines[-1][0] == pytest.approx(data["stamp"][known][-1], abs=1e-5)
    pixels = np.array([[p.x, p.y] for p in lines[-1][1].points[0].points])  # 0.1 s apart
    for column, place in (("filtered", pixels[0]), ("predicted", pixels[2:4].mean(axis=0))):
        np.testing.assert_allclose(place, [data[f"{column}_{axis}"][known][-1] for axis in "uv"], atol=0.3)
    numbers = topics["/signals/filtered"][-1][1]
    assert numbers.u == pytest.approx(data["filtered_u"][known][-1], abs=1e-5) and numbers.speed > 10.0


@pytest.mark.parametrize("calibrated", [False, True])
def test_the_missing_extra_is_named(tracked, tmp_path, monkeypatch, capfd, calibrated):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    options = ["--calibration", str(tracked / "stereo.yaml"), "--plane", "board"] if calibrated else []
    source = str(tracked / "left.mkv")
    assert cli.main(["track", source, *options, "--no-overlay", "--mcap", "--out", str(tmp_path / "none")]) == 2
    assert "pip install 'drake-tracker[mcap]'" in capfd.readouterr().err
