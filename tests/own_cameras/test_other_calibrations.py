"""Tracks through wide lenses, with calibration files of this package and of other tools."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from films import CAMERAS, HEIGHT, WIDTH, draw, on_circle, read_track, write_images

from drake_tracker import cli
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration
from drake_tracker.cameras.files.camera_files import save_foreign
from drake_tracker.commands.track import split_calibration
from drake_tracker.core.errors import DrakeTrackerError, DrakeTrackerWarning
from drake_tracker.own_cameras.preparation import prepare_track

TIMES = np.arange(30) / 30.0
LENSES = {"fisheye": [0.05, -0.02, 0.004, 0.0], "pinhole": [0.6, 0.1, 0.001, -0.001, 0.02, 0.9, 0.2, 0.03]}


def wide(lens):
    """The cameras of the films with a wide lens, in the frame of the left one."""
    X_WL = CAMERAS["camera_left"].X_WC
    K = CAMERAS["camera_left"].K * [[0.9, 1.0, 1.0], [1.0, 0.9, 1.0], [1.0, 1.0, 1.0]]
    return {
        name: CameraModel(K, LENSES[lens], camera.X_CW @ X_WL, WIDTH, HEIGHT, lens) for name, camera in CAMERAS.items()
    }


def p_LQ(time):
    """The ball's centre (n, 3) [m] in the frame of the left camera."""
    X_LW = CAMERAS["camera_left"].X_CW
    return on_circle(time) @ X_LW[:3, :3].T + X_LW[:3, 3]


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """{lens: folders of the left and the right images}."""
    folder = tmp_path_factory.mktemp("films")
    return {
        lens: [
            write_images(folder / f"{lens}_{name}", [draw(camera, p_LQ(t), np.random.default_rng(0)) for t in TIMES])
            for name, camera in wide(lens).items()
        ]
        for lens in LENSES
    }


@pytest.mark.parametrize("lens", LENSES)
def test_two_cameras_with_a_wide_lens(tmp_path, films, lens):
    save_calibration(tmp_path / "wide.yaml", wide(lens))
    arguments = ["--calibration", f"{tmp_path}/wide.yaml", *films[lens], "--fps", "30", "--no-overlay"]
    assert cli.main(["track", *arguments, "--out", f"{tmp_path}/out"]) == 0
    data = read_track(tmp_path / "out")
    points = np.column_stack([data[name] for name in "xyz"])
    assert len(points) > 20 and data["valid"].all()
    assert np.linalg.norm(points - p_LQ(data["stamp"]), axis=1).max() < 0.003


def test_a_fisheye_and_a_plane(tmp_path, films):
    save_calibration(tmp_path / "wide.yaml", wide("fisheye"))
    X_WC = CAMERAS["camera_left"].X_CW  # the plane z = 0 of the films, in the frame of the left camera
    c, s = np.cos(0.3), np.sin(0.3)
    X_circle = np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0.06], [0, 0, 0, 1.0]])
    (tmp_path / "plane.yaml").write_text(yaml.safe_dump({"X_WP": (X_WC @ X_circle).tolist()}))
    arguments = [films["fisheye"][0], "--calibration", f"{tmp_path}/wide.yaml", "--plane", f"{tmp_path}/plane.yaml"]
    assert cli.main(["track", *arguments, "--fps", "30", "--no-overlay", "--out", f"{tmp_path}/out"]) == 0
    data = read_track(tmp_path / "out")
    points = np.column_stack([data[name] for name in "xyz"])
    assert data["valid"].all() and np.linalg.norm(points - p_LQ(data["stamp"]), axis=1).max() < 0.003


def prepared(sources, files, **options):
    """The cameras of a track that is prepared and not made."""
    tracking = prepare_track(sources, calibration=files, fps=30, **options)
    for footage in tracking.footage:
        footage.close()
    return tracking


@pytest.mark.parametrize(("form", "lens"), [("kalibr", "fisheye"), ("opencv", "pinhole"), ("ros", "pinhole")])
def test_files_of_other_tools(tmp_path, films, form, lens):
    files = save_foreign(tmp_path / "rig.yaml", wide(lens), form)
    tracking = prepared(films[lens], files)
    for camera, truth in zip(tracking.cameras, wide(lens).values()):
        np.testing.assert_allclose(camera.project(p_LQ(TIMES)), truth.project(p_LQ(TIMES)), atol=1e-9)
    assert tracking.world == "camera_left"
    assert tracking.facts["calibration"] == " and ".join(map(str, files))


def test_the_images_give_the_size_that_a_file_does_not_contain(tmp_path, films):
    (file,) = save_foreign(tmp_path / "rig.yml", wide("pinhole"), "opencv")
    text = re.sub(r"image_size\d: !!opencv-matrix\n( .*\n)+|image_(width|height): .*\n", "", file.read_text())
    assert "image_" not in text
    file.write_text(text)
    with pytest.warns(DrakeTrackerWarning, match=r"suggests about 320 x 240 px, and 320 x 240 px are assumed"):
        cameras = prepared(films["pinhole"], file).cameras
    assert [(each.width, each.height) for each in cameras] == [(WIDTH, HEIGHT)] * 2
    for scale in (0.7, 1.25, 1.5, 2.0):
        changed = text
        for centre in ((WIDTH - 1) / 2, (HEIGHT - 1) / 2):
            changed = changed.replace(str(centre), str(scale * (centre + 0.5) - 0.5))
        file.write_text(changed)
        size = f"about {scale * WIDTH:.0f} x {scale * HEIGHT:.0f} px, but .* has {WIDTH} x {HEIGHT} px"
        with pytest.raises(DrakeTrackerError, match=size):
            prepared(films["pinhole"], file)


@pytest.mark.parametrize(
    ("files", "options", "message"),
    [
        ("kalibr.yaml", {"plane": "board"}, "kalibr.yaml does not say where a board was; give a file with the pose"),
        ("kalibr.yaml own.yaml", {}, "own.yaml is a file of drake-tracker, kalibr.yaml one of Kalibr"),
        ("own.yaml own.yaml", {}, "give one file, or two different ones"),
        ("left.yaml", {}, "left.yaml: there is no camera_right; found camera_left"),
        ("text.yaml", {}, "text.yaml: not a calibration of drake-tracker (cameras), OpenCV"),
        ("nowhere.yaml left.yaml", {}, "nowhere.yaml: the calibration cannot be read"),
    ],
)
def test_calibrations_that_do_not_suit(tmp_path, monkeypatch, films, capfd, files, options, message):
    monkeypatch.chdir(tmp_path)
    cameras = wide("fisheye")
    save_calibration("own.yaml", cameras)
    save_foreign(Path("kalibr.yaml"), cameras, "kalibr")
    save_foreign(Path("left.yaml"), dict(list(cameras.items())[:1]), "ros")
    Path("text.yaml").write_text("a: 1")
    sources = films["fisheye"][: 1 if options else 2]
    extra = [word for name, value in options.items() for word in (f"--{name}", value)]
    assert cli.main(["track", *sources, "--fps", "30", *extra, "--calibration", *files.split()]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("drake-tracker: ") and message in line


def test_what_follows_the_calibration_may_be_footage(capfd):
    assert split_calibration(["a.yaml", "left.mp4", "right.mp4"]) == (["a.yaml"], ["left.mp4", "right.mp4"])
    assert split_calibration(["a", "b.xml", "0", "1"]) == (["a", "b.xml"], ["0", "1"])
    assert cli.main(["track", "--calibration", "a.yaml", "b.yaml"]) == 2
    assert "track: no SOURCE; give a video" in capfd.readouterr().err
