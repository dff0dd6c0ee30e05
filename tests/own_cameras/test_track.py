"""Tracks of your own cameras, from files to files: synthetic cameras see a ball on a known circle in space."""

import errno
import itertools
import json
import shlex
import shutil
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from films import BALL, CAMERAS, film, on_circle, read_track, write_calibration, write_images, write_video

from drake_tracker import cli
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import MachineError
from drake_tracker.footage import sources
from drake_tracker.footage.live_camera import open_camera
from drake_tracker.own_cameras import table as track_table

TIMES = np.arange(75) / 30.0
FILMS = {}


def images(side):
    if side not in FILMS:
        FILMS[side] = film(side, TIMES)
    return FILMS[side]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_calibration(tmp_path / "stereo.yaml")
    return tmp_path


def videos(folder, left=slice(None), right=slice(None)):
    kept = {side: np.arange(len(TIMES))[which] for side, which in (("left", left), ("right", right))}
    for side, numbers in kept.items():
        write_video(folder / f"{side}.mkv", [images(side)[k] for k in numbers], TIMES[numbers])
    return ["left.mkv", "right.mkv"]


def track(*arguments):
    return cli.main(["track", *map(str, arguments), "--out", "out"])


def errors(data, path=on_circle):
    """Distance [m] of each point of a track from the ball at its stamp, NaN where there is no point."""
    points = np.column_stack([data[name] for name in "xyz"])
    return np.linalg.norm(points - path(data["stamp"]), axis=1)


def one_line(capfd, *words):
    lines = capfd.readouterr().err.splitlines()
    said = [line for line in lines if line.startswith("drake-tracker: ")]
    assert len(said) == 1 and not any("Traceback" in line for line in lines)
    assert all(word in said[0] for word in words), said[0]


def test_a_custom_estimator_predicts_the_path(folder, monkeypatch):
    monkeypatch.setattr("sys.path", list(sys.path))
    shutil.copy(Path(__file__).parents[1] / "own_estimator.py", "my_track_estimator.py")
    assert track(*videos(folder), "--calibration", "stereo.yaml", "--no-overlay",
                 "--estimator", "!Custom {call: my_track_estimator.StraightOn}") == 0  # fmt: skip
    assert np.sum(np.isfinite(read_track(folder / "out")["predicted_x"])) > 30


@pytest.mark.pictures
def test_two_videos_give_the_path_in_space(folder, capsys):
    assert track(*videos(folder), "--calibration", "stereo.yaml") == 0
    assert {path.name for path in (folder / "out").iterdir()} == {
        "track.csv", "track.png", "overlay.mp4", "summary.json",
    }  # fmt: skip
    data = read_track(folder / "out")
    off = errors(data)
    assert len(off) == 73 and data["valid"].all()
    assert np.sqrt(np.mean(off**2)) < 0.0007 and off.max() < 0.002
    assert np.nanmax(data["gap"]) < 0.002
    for side in ("left", "right"):
        pixels = CAMERAS[f"camera_{side}"].project(on_circle(data["stamp"]))
        assert np.abs(np.column_stack([data[f"{side}_u"], data[f"{side}_v"]]) - pixels).max() < 1.0
    late = data["stamp"] > 1.0
    filtered = {name: data[f"filtered_{name}"][late] for name in "xy"}
    truth = on_circle(data["stamp"][late])
    assert np.hypot(filtered["x"] - truth[:, 0], filtered["y"] - truth[:, 1]).max() < 0.003
    truth = on_circle(data["stamp"][late] + 0.25)
    assert np.hypot(data["predicted_x"][late] - truth[:, 0], data["predicted_y"][late] - truth[:, 1]).max() < 0.01
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert (summary["results"], summary["dropped"]) == (73, [0, 0])
    assert summary["frame_rate"] == pytest.approx(30.0, abs=0.01)
    assert "images described" in capsys.readouterr().out


@pytest.mark.parametrize("detector, lost", [("NormalFlow", 3), ("!FrameDifference {stride: 2}", 2)])
def test_a_dropped_image_costs_only_the_points_that_use_it(folder, detector, lost):
    dropped = np.setdiff1d(np.arange(len(TIMES)), [30, 50])
    sources = videos(folder, left=dropped)
    arguments = ("--calibration", "stereo.yaml", "--detector", detector, "--no-overlay")
    assert track(*sources, *arguments) == 0
    data = read_track(folder / "out")
    assert (data["valid"] == 0).sum() == 2 * lost
    gone = np.abs(data["stamp"][data["valid"] == 0][:, None] - TIMES[[30, 50]]).min(axis=1)
    assert gone.max() < 0.034
    assert np.isnan(data["x"][data["valid"] == 0]).all()
    assert np.nanmax(errors(data)) < 0.002
    assert json.loads((folder / "out" / "summary.json").read_text())["dropped"] == [2, 0]


def test_missing_numbers_in_a_folder_are_dropped_images(folder):
    kept = np.setdiff1d(np.arange(45), [20])
    left = write_images(folder / "left", [images("left")[k] for k in kept], kept)
    right = write_images(folder / "right", images("right")[:45])
    arguments = ("--calibration", "stereo.yaml", "--fps", "30", "--no-overlay", "--estimator", "ClosedPath {}")
    assert track(left, right, *arguments) == 0
    data = read_track(folder / "out")
    assert (data["valid"] == 0).sum() == 3 and np.nanmax(errors(data)) < 0.002


def test_folders_with_the_same_numbering_share_a_clock(folder):
    """The first images of the right camera are missing: the others keep the times that their numbers imply."""
    left = write_images(folder / "left", images("left")[:45], range(45))
    right = write_images(folder / "right", images("right")[5:45], range(5, 45))
    arguments = ("--calibration", "stereo.yaml", "--fps", "30", "--no-overlay")
    assert track(left, right, *arguments) == 0
    data = read_track(folder / "out")
    assert (data["valid"] == 1).sum() > 30 and np.nanmax(errors(data)) < 0.002


def test_swapped_cameras_are_suspected(folder, capsys):
    for name, other in (("left", "right"), ("right", "left")):
        write_video(folder / f"{name}.mkv", images(other)[:45], TIMES[:45])
    track("left.mkv", "right.mkv", "--calibration", "stereo.yaml", "--no-overlay")
    said = capsys.readouterr().out
    assert "The cameras are swapped" in said and "No motion was found" not in said
    assert json.loads((folder / "out" / "summary.json").read_text())["swapped"] is True


def test_a_plane_that_only_the_motion_misses_is_named(folder, capsys):
    """The lower part of the image sees the plane, the ball moves above its horizon."""
    X = np.eye(4)
    X[2, 3] = 0.45 - 0.001  # just below the camera
    (folder / "plane.yaml").write_text(yaml.safe_dump({"X_WP": X.tolist()}))
    rolled = CAMERAS["camera_left"].X_CW.copy()
    rolled[:3, :3] = cv2.Rodrigues(np.array([-0.7, 0.0, 0.0]))[0] @ rolled[:3, :3]
    rolled[:3, 3] = -rolled[:3, :3] @ CAMERAS["camera_left"].X_WC[:3, 3]
    camera = CAMERAS["camera_left"]
    tilted = CameraModel(camera.K, camera.distortion, rolled, camera.width, camera.height)
    write_calibration(folder / "tilted.yaml", {"camera_left": tilted})
    write_video(folder / "left.mkv", images("left")[:30], TIMES[:30])
    assert track("left.mkv", "--calibration", "tilted.yaml", "--plane", "plane.yaml", "--no-overlay") == 1
    assert "does not see the plane of the motion" in capsys.readouterr().out


def test_an_estimator_that_raises_midway_leaves_the_track_so_far(folder, monkeypatch, capfd):
    (folder / "late.py").write_text(
        "from drake_tracker.estimation.parts.turn_filter import TurnFilter\n"
        "class Late(TurnFilter):\n"
        "    def update(self, state, stamp, p_WQ):\n"
        "        if stamp > 1.5:\n"
        "            raise ValueError('too late')\n"
        "        return super().update(state, stamp, p_WQ)\n"
    )
    monkeypatch.setattr("drake_tracker.diagrams.parts.check_estimator", lambda *_: None)
    arguments = ("--calibration", "stereo.yaml", "--no-overlay", "--estimator", "!Custom {call: late.Late}")
    assert track(*videos(folder), *arguments) == 2
    said = capfd.readouterr().err.splitlines()[-1]
    assert said.startswith(
        "drake-tracker: --estimator: late.Late.update raised ValueError: too late (late.py line 5); "
    )
    assert len(read_track(folder / "out")["stamp"]) > 20
    assert (folder / "out" / "summary.json").is_file() and (folder / "out" / "track.png").is_file()


def test_a_single_video_gives_the_centroid(folder):
    write_video(folder / "left.mkv", images("left")[:30], TIMES[:30])
    assert track("left.mkv") == 0
    data = read_track(folder / "out")
    filtered = ["filtered_u", "filtered_v", "predicted_u", "predicted_v"]
    assert list(data) == ["stamp", "u", "v", "pixel_count", "valid", *filtered, "id", "state"]
    pixels = CAMERAS["camera_left"].project(on_circle(data["stamp"]))
    assert np.abs(np.column_stack([data["u"], data["v"]]) - pixels).max() < 1.0


@pytest.mark.parametrize("plane", ["board", "plane.yaml"])
def test_one_camera_and_a_plane(folder, plane):
    def level(time):
        return on_circle(time, tilt=0.0)

    write_video(folder / "left.mkv", film("left", TIMES[:30], level), TIMES[:30])
    height = 0.06
    if plane != "board":
        X = np.eye(4)
        X[2, 3] = 0.04
        (folder / plane).write_text(yaml.safe_dump({"X_WP": X.tolist()}))
        height -= 0.04
    assert track("left.mkv", "--calibration", "stereo.yaml", "--plane", plane, "--height", height) == 0
    data = read_track(folder / "out")
    assert data["valid"].all() and errors(data, level).max() < 0.002


def two_balls(count=40):
    """Images of a small ball that moves right and a larger one that moves left below it; the small one's columns."""
    rows, columns = np.mgrid[:240, :320]
    texture = 90.0 + 20.0 * np.sin(0.4 * columns) * np.cos(0.5 * rows)
    small = 40.0 + 5.0 * np.arange(count)
    pictures = []
    for u in small:
        image = texture.copy()
        image[np.hypot(columns - u, rows - 60) < 12] = 230.0
        image[np.hypot(columns - (280 - u), rows - 170) < 35] = 20.0
        pictures.append(image.astype(np.uint8))
    return pictures, small


def test_the_object_at_a_pixel_is_followed_beside_a_larger_one(folder, capsys):
    pictures, small = two_balls()
    source = write_images(folder / "shots", pictures)
    assert track(source, "--fps", "30", "--follow", "40,60") == 0
    data = read_track(folder / "out")
    assert data["valid"].all() and len(set(data["id"])) == 1
    expected = np.interp(data["stamp"], np.arange(len(small)) / 30.0, small)
    assert np.hypot(data["u"] - expected, data["v"] - 60.0).max() < 2.0
    assert "another moving object was about as large" in capsys.readouterr().out
    assert json.loads((folder / "out" / "summary.json").read_text())["images_with_rivals"] > 20


def test_several_objects_have_a_row_each(folder):
    source = write_images(folder / "shots", two_balls()[0])
    assert track(source, "--fps", "30", "--objects", "2", "--no-overlay") == 0
    lines = (folder / "out" / "track.csv").read_text().splitlines()
    assert lines[0].endswith(",predicted_v,id,state") and lines[-1].endswith(",moving")
    data = read_track(folder / "out")
    last = data["stamp"] == data["stamp"][-1]
    assert last.sum() == 2 and sorted(np.rint(data["v"][last])) == [60.0, 170.0]
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert summary["described"] == summary["results"] == 38 and summary["objects_seen"] == 2


def test_motion_outside_of_the_region_of_interest_does_not_count(folder):
    source = write_images(folder / "shots", two_balls()[0])
    assert track(source, "--fps", "30", "--roi", "0,0 319,0 319,100 0,100", "--no-overlay") == 0
    data = read_track(folder / "out")
    assert data["valid"].all() and np.abs(data["v"] - 60.0).max() < 2.0


def test_an_object_that_is_not_there_is_not_a_success(folder, capsys):
    source = write_images(folder / "shots", two_balls()[0])
    assert track(source, "--fps", "30", "--follow", "10,235", "--no-overlay") == 1
    assert "followed in 0 of 38 images only" in capsys.readouterr().out


def test_no_motion_is_not_a_success(folder, capsys):
    write_video(folder / "left.mkv", [images("left")[0]] * 30, TIMES[:30])
    assert track("left.mkv", "--no-overlay") == 1
    assert "No motion was found" in capsys.readouterr().out
    assert (folder / "out" / "track.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("left.mkv right.mkv", ["--calibration FILE"]),
        ("left.mkv --calibration stereo.yaml", ["--plane"]),
        ("left.mkv --calibration nowhere.yaml --plane board", ["nowhere.yaml", "cannot be read"]),
        ("left.mkv --calibration stereo.yaml --plane nowhere.yaml", ["nowhere.yaml"]),
        ("left.mkv --calibration stereo.yaml --plane stereo.yaml", ["stereo.yaml: X_WP must contain 4 x 4"]),
        ("left.mkv --calibration stereo.yaml --plane board --camera top", ["there is no top; found camera_left"]),
        ("left.mkv --plane board", ["single camera with --calibration"]),
        ("left.mkv short.mkv --calibration stereo.yaml", ["lasts 1.00 s", "ends after 0.67 s", "--duration 0.66"]),
        ("left.mkv left.mkv --calibration stereo.yaml", ["are the same images"]),
        ("left.mkv copy.mkv --calibration stereo.yaml", ["left.mkv and copy.mkv are the same images"]),
        ("left.mkv --calibration stereo.yaml --plane behind.yaml", ["behind.yaml: the plane is out of view"]),
        ("left.mkv --fps 0", ["--fps 0: must be above 0"]),
        ("left.mkv --fps nan", ["--fps nan: must be above 0"]),
        ("left.mkv --fps 1e9", ["--fps 1e+09: must be from 0.01 to 100000"]),
        ("left.mkv short.mkv --calibration wide.yaml", ["wide.yaml", "640 x 480 px", "320 x 240 px"]),
        ("text.mkv", ["text.mkv: this video cannot be read"]),
        ("nowhere.mkv", ["nowhere.mkv: there is no such file"]),
        ("left.mkv --detector Eye", ["detector must be one of !NormalFlow, !FrameDifference"]),
        ("left.mkv --detector '!NormalFlow {foo: 1}'", ["detector.foo"]),
        ("left.mkv --estimator '!!ArcLength {}'", ["!!ArcLength is not a kind; write one !"]),
        ("left.mkv --max-gap inf", ["--max-gap inf: must be above 0 and finite"]),
        ("left.mkv --estimator Oracle", ["estimator must be one of !CoordinatedTurn"]),
        ("left.mkv --fps -1", ["--fps -1: must be above 0"]),
        ("left.mkv --offset nan", ["--offset nan: must be a finite number"]),
        ("left.mkv --follow 400,10", ["--follow 400,10: outside of the image of 320 x 240 px"]),
        ("left.mkv --follow here", ["--follow here: must be U,V in pixels"]),
        ("left.mkv --roi 1,2,3", ["--roi 1,2,3: must be X,Y,W,H"]),
        ("left.mkv --roi 900,900,10,10", ["outside of the image"]),
        ("left.mkv --roi '1,2 3,4'", ["three corners"]),
        ("left.mkv --objects 0", ["--objects 0: must be from 1"]),
        ("left.mkv left.mkv --calibration stereo.yaml --follow 1,1", ["one for each camera, here 2"]),
        ("a b c", ["3 sources"]),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(folder, capfd, arguments, words):
    write_video(folder / "left.mkv", images("left")[:30], TIMES[:30])
    write_video(folder / "short.mkv", images("right")[:20], TIMES[:20])
    (folder / "text.mkv").write_text("this is no video")
    shutil.copy(folder / "left.mkv", folder / "copy.mkv")
    behind = np.eye(4)
    behind[2, 3] = 3.0
    (folder / "behind.yaml").write_text(yaml.safe_dump({"X_WP": behind.tolist()}))
    wide = {name: CameraModel(c.K, c.distortion, c.X_CW, 640, 480) for name, c in CAMERAS.items()}
    write_calibration(folder / "wide.yaml", wide)
    assert track(*shlex.split(arguments)) == 2
    one_line(capfd, *words)
    assert not (folder / "out").exists()


class Device:
    """Two connected cameras, 0 and 1: the images of the films in order, until they are unplugged."""

    def __init__(self, number):
        self._images = iter(images(("left", "right")[number])[:40])

    def isOpened(self):
        return True

    def set(self, key, value):
        return True

    def get(self, key):
        return 30.0

    def grab(self):
        self._image = next(self._images, None)
        return self._image is not None

    def retrieve(self):
        return True, np.repeat(self._image[..., None], 3, axis=2)

    def read(self):
        return self.grab(), self.retrieve()[1]

    def release(self):
        pass


@pytest.fixture
def plugged_in(monkeypatch):
    """Each camera has its own simulated clock, so that both take an image every 1/30 s."""

    def opened(number, fps=None):
        clock = itertools.count()
        return open_camera(number, fps, device=Device, clock=lambda: 100.0 + next(clock) / 30.0)

    monkeypatch.setattr(sources, "open_camera", opened)


def test_two_live_cameras_for_a_duration(folder, plugged_in):
    assert track("0", "1", "--calibration", "stereo.yaml", "--duration", "1", "--no-overlay") == 0
    data = read_track(folder / "out")
    assert data["valid"].all() and len(data["valid"]) == 28 and errors(data).max() < 0.002


def test_an_unplugged_camera_leaves_the_track_so_far(folder, plugged_in, capfd):
    assert track("0", "--no-overlay") == 2
    one_line(capfd, "camera 0: it delivers no more images")
    assert len(read_track(folder / "out")["stamp"]) > 30


def test_a_damaged_image_is_a_dropped_one(folder, capfd):
    numbered = write_images(folder / "left", images("left")[:30])
    (folder / "left" / "image00020.png").write_text("this is no image")
    assert track(numbered, "--fps", "30") == 0
    one_line(capfd, "left: 1 of 30 images cannot be read: image00020.png")
    data = read_track(folder / "out")
    assert len(data["stamp"]) == 28 and (data["valid"] == 0).sum() == 3
    assert json.loads((folder / "out" / "summary.json").read_text())["dropped_at_s"] == [[0.667]]
    assert {path.name for path in (folder / "out").iterdir()} >= {"overlay.mp4", "summary.json", "track.png"}


def test_a_full_disk_is_one_line_and_keeps_what_was_written(folder, capfd, monkeypatch):
    add = track_table.TrackTable.add

    def full(table, *ports):
        if len(table.rows) == 10:
            raise OSError(errno.ENOSPC, "No space left on device")
        return add(table, *ports)

    monkeypatch.setattr(track_table.TrackTable, "add", full)
    write_video(folder / "left.mkv", images("left")[:30], TIMES[:30])
    assert track("left.mkv") == 2
    one_line(capfd, "out: cannot be written: No space left on device")
    assert len(read_track(folder / "out")["stamp"]) == 10


def test_an_interrupted_track_is_kept(folder, monkeypatch):
    add = track_table.TrackTable.add

    def interrupted(table, *ports):
        if len(table.rows) == 10:
            raise KeyboardInterrupt
        return add(table, *ports)

    monkeypatch.setattr(track_table.TrackTable, "add", interrupted)
    write_video(folder / "left.mkv", images("left")[:30], TIMES[:30])
    assert track("left.mkv", "--no-overlay") == 130
    assert json.loads((folder / "out" / "summary.json").read_text())["interrupted"] is True


def test_the_ball_covers_enough_pixels():
    """The rig of these tests is realistic: the ball covers some 30 px."""
    camera = CAMERAS["camera_left"]
    depth = (camera.X_CW @ [*on_circle(0.0), 1.0])[2]
    assert 12 < camera.K[0, 0] * 2 * BALL / depth < 35


def in_unit(unit):
    """The cameras with lengths in another unit of so many metres."""
    scaled = {}
    for name, camera in CAMERAS.items():
        X_CW = camera.X_CW.copy()
        X_CW[:3, 3] /= unit
        scaled[name] = CameraModel(camera.K, camera.distortion, X_CW, camera.width, camera.height)
    return scaled


def test_a_calibration_in_millimetres_gives_the_same_track_in_millimetres(folder):
    write_calibration(folder / "mm.yaml", in_unit(0.001))
    sources = videos(folder)
    tracks = []
    for name in ("stereo", "mm"):
        assert cli.main(["track", *sources, "--calibration", f"{name}.yaml", "--no-overlay", "--out", name]) == 0
        tracks.append(read_track(folder / name))
    metres, millimetres = tracks
    for column in ("x", "gap", "filtered_y", "predicted_x"):
        np.testing.assert_allclose(1000.0 * metres[column], millimetres[column], atol=0.01)
    summary = json.loads((folder / "mm" / "summary.json").read_text())
    assert summary["filtered"] == {"points": 73, "filtered": 65, "start": 8, "after_a_gap": 0, "after_a_jump": 0}
    assert summary["max_gap"] == pytest.approx(28.0, rel=0.3) and summary["estimator"]["scaled_to_data"] is True


def test_points_that_are_not_filtered_are_counted_by_reason(folder, capsys):
    there = films_with_a_jump()
    write_video(folder / "left.mkv", there, TIMES[:60])
    assert track("left.mkv", "--calibration", "stereo.yaml", "--plane", "board", "--no-overlay") == 0
    counts = json.loads((folder / "out" / "summary.json").read_text())["filtered"]
    assert counts["start"] == 8 and counts["after_a_jump"] > 3
    assert f"{counts['filtered']} of {counts['points']}; not filtered: 8 at the start" in capsys.readouterr().out


def films_with_a_jump():
    """The left camera's images of a ball that is suddenly on the other side of its circle."""
    return film("left", TIMES[:30]) + film("left", TIMES[:30] + 2.0)


@pytest.mark.pictures
def test_the_picture_is_drawn_where_no_process_can_be_started(folder, monkeypatch):
    def refuse(*_, **__):
        raise MachineError("too many processes")

    monkeypatch.setattr("drake_tracker.own_cameras.picture_process.ChildProcess", refuse)
    write_video(folder / "left.mkv", images("left")[:20], TIMES[:20])
    assert track("left.mkv", "--no-overlay") == 0
    assert (folder / "out" / "track.png").read_bytes()[1:4] == b"PNG"


@pytest.mark.pictures
def test_a_long_name_in_another_script_is_drawn_without_a_warning(folder, capfd):
    name = f"測試 $x$ {'長' * 60}.mkv"
    write_video(folder / name, images("left")[:20], TIMES[:20])
    assert track(name, "--no-overlay") == 0
    assert "Warning" not in capfd.readouterr().err and (folder / "out" / "track.png").is_file()
