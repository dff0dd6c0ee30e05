"""Files of calibrations, measured errors, poses and logs that somebody made up: one line, and nothing of them runs."""

import os
import pickle
import re

import numpy as np
import pytest
import yaml

from drake_tracker.cameras.boards.board_poses import load_poses
from drake_tracker.cameras.files.calibration_file import load_calibration, load_pose
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.measured.measured_error_file import load_error
from drake_tracker.tasks import scenario_file
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import describe_rig

RIG = describe_rig(CamerasConfig())
BOMB = "x: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"x{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefgh", "bcdefghi")
)


class Runs:
    """An object whose pickle makes a folder when it is loaded."""

    def __reduce__(self):
        return os.mkdir, ("ran",)


def changed(name, *changes):
    """Returns the text of a file of the package with (key, value) changed."""
    text = scenario_file(name).read_text()
    for key, value in changes:
        text, count = re.subn(rf"^(\s*){key}:.*(\n\1- .*)*$", rf"\1{key}: {value}", text, count=1, flags=re.MULTILINE)
        assert count == 1
    return text


def error_of(load, *arguments):
    with pytest.raises(DrakeTrackerError) as caught:
        load(*arguments)
    (line,) = str(caught.value).splitlines()
    return line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (changed("train_cameras.yaml", ("width", "wide")), "made with rig.width = wide, but"),
        (changed("train_cameras.yaml", ("look_at", "[[1], [1, 2]]")), "made with rig.look_at = "),
        (changed("train_cameras.yaml", ("distance", f"1{'0' * 400}")), "made with rig.distance = 1000"),
        (changed("train_cameras.yaml", ("distortion", "[1e+308, 0, 0, 0, 0]")), "has a number beyond 10000"),
        (changed("train_cameras.yaml", ("K", "[[1e+308, 0, 1], [0, 1, 1], [0, 0, 1]]")), "has a number beyond 100000"),
        (changed("train_cameras.yaml", ("K", f"[[1{'0' * 400}, 0, 1], [0, 1, 1], [0, 0, 1]]")), "3 x 3 finite numbers"),
        (
            changed("train_cameras.yaml", ("width", "256")).replace("    width: 256", "    width: 1000000000000"),
            "to 1000",
        ),
        (changed("train_cameras.yaml", ("distance", "!!bool maybe")), "is not a value of the type !!bool"),
        (BOMB + "cameras: {left: {width: 1, height: 1, K: *i}}\nrig: {}\n", "more than 100000 values"),
        ("cameras: " + "[" * 300 + "]" * 300, "nested too deeply"),
        ("#" * 300_000, "more than 256 KiB"),
    ],
)
def test_a_calibration_that_somebody_made_up(tmp_path, text, message):
    path = tmp_path / "cameras.yaml"
    path.write_text(text)
    assert message in error_of(load_calibration, path, None if text.startswith("x") else RIG)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (changed("train_vision.yaml", ("pixel", "1e+308")), "pixel must be a finite number"),
        (changed("train_vision.yaml", ("pixel", f"1{'0' * 400}")), "pixel must be a finite number"),
        (changed("train_vision.yaml", ("fov_deg", "[1, [2]]")), "made with rig.fov_deg = "),
        (changed("train_vision.yaml", ("pixel", "!!bool maybe")), "this is not YAML"),
    ],
)
def test_a_measured_error_that_somebody_made_up(tmp_path, text, message):
    path = tmp_path / "vision.yaml"
    path.write_text(text)
    assert message in error_of(load_error, path, RIG)


def test_a_pose_that_somebody_made_up(tmp_path):
    path = tmp_path / "pose.yaml"
    pose = np.eye(4).tolist()
    path.write_text(yaml.safe_dump({"X_WP": pose}))
    assert load_pose(path, "X_WP").tolist() == pose
    pose[0][3] = 1e308
    path.write_text(yaml.safe_dump({"X_WP": pose}))
    assert "X_WP must contain 4 x 4 numbers" in error_of(load_pose, path, "X_WP")


def test_no_reader_waits_at_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for load in (load_calibration, load_error):
        assert "cannot be read" in error_of(load, tmp_path / "pipe")


def test_no_reader_of_arrays_loads_a_pickle(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    objects = np.array([Runs()], dtype=object)
    np.savez("log.npz", **{"point": objects, "point.time": objects, "point.names": objects})
    np.savez("board.npz", **dict.fromkeys(("X_CB", "X_WB", "rms", "points", "image", "circles"), objects))
    for load, path in ((load_log, "log.npz"), (load_poses, tmp_path / "board.npz")):
        error_of(load, path)
        (tmp_path / path).write_bytes(pickle.dumps(Runs()))
        error_of(load, path)
    assert not (tmp_path / "ran").exists()
