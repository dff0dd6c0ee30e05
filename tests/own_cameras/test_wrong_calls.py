"""Calls of `drake-tracker track` that cannot work: one line each, exit code 2, and nothing is left behind."""

import os
import shlex
import shutil
import sys

import cv2
import numpy as np
import pytest
import yaml
from films import CAMERAS, film, write_calibration, write_images, write_video

from drake_tracker import cli

TIMES = np.arange(12) / 30.0


@pytest.fixture(scope="module")
def shelf(tmp_path_factory):
    """A folder with good and bad files, which is copied by nobody and changed by no call."""
    folder = tmp_path_factory.mktemp("shelf")
    pictures = film("left", TIMES)
    write_video(folder / "good.mkv", pictures, TIMES)
    write_video(folder / "right.mkv", film("right", TIMES), TIMES)
    write_video(folder / "short.mkv", pictures[:3], TIMES[:3])
    write_video(folder / "slow.mkv", pictures, 4.0 * TIMES)
    write_video(folder / "small.mkv", [cv2.resize(each, (160, 120)) for each in pictures], TIMES)
    whole = (folder / "good.mkv").read_bytes()
    (folder / "empty.mp4").write_bytes(b"")
    (folder / "cut.mp4").write_bytes(b"\0\0\0\x20ftypisom" + bytes(100))
    (folder / "header.mkv").write_bytes(whole[:200])
    (folder / "text.avi").write_text("this is no video")
    (folder / "zeros.mkv").write_bytes(bytes(len(whole)))
    os.mkfifo(folder / "pipe.mkv")
    (folder / "nothing").mkdir()
    (folder / "notes").mkdir()
    (folder / "notes" / "read.txt").write_text("no image")
    (folder / "one").mkdir()
    shutil.copyfile(folder / "empty.mp4", folder / "one" / "0001.png")
    write_images(folder / "few", pictures[:4])
    write_images(folder / "mixed", pictures)
    cv2.imwrite(str(folder / "mixed" / "image00005.png"), pictures[5][:100])
    write_images(folder / "same", pictures)
    shutil.copyfile(folder / "same" / "image00002.png", folder / "same" / "image2.png")
    write_images(folder / "odd", pictures)
    shutil.copyfile(folder / "odd" / "image00002.png", folder / "odd" / "cover.png")
    (folder / "bag").mkdir()
    (folder / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    (folder / "bad.db3").write_bytes(b"no database")
    (folder / "bad.mcap").write_bytes(b"no mcap")
    write_calibration(folder / "stereo.yaml")
    write_calibration(folder / "one.yaml", {"camera_left": CAMERAS["camera_left"]})
    (folder / "list.yaml").write_text("- 1\n- 2\n")
    (folder / "broken.yaml").write_text("cameras: {a: [1, 2")
    (folder / "nan.yaml").write_text(yaml.safe_dump({"X_WP": [[float("nan")] * 4] * 4}))
    (folder / "full").mkdir()
    (folder / "full" / "file").write_text("in use")
    return folder


CALLS = [
    ("empty.mp4", "empty.mp4: this video cannot be read"),
    ("cut.mp4", "cut.mp4: this video cannot be read"),
    ("header.mkv", "header.mkv"),
    ("zeros.mkv", "zeros.mkv: this video cannot be read"),
    ("text.avi", "text.avi: this video cannot be read"),
    ("pipe.mkv", "pipe.mkv: is neither a regular file nor a folder"),
    ("''", "the name of a source is empty"),
    ("nowhere.mp4", "nowhere.mp4: there is no such file, folder or camera"),
    ("short.mkv", "short.mkv: there are 3 images; at least 8 are needed"),
    ("nothing", "nothing: there are no images"),
    ("notes", "notes: there are no images"),
    ("'nothing/*.png'", "no file matches it as a pattern"),
    ("one --fps 30", "0001.png: this image cannot be read"),
    ("few --fps 30", "few: there are 4 images"),
    ("few", "few: the names of these images do not contain capture times; add --fps N"),
    ("mixed --fps 30", "image00005.png has 320 x 100 px, the images before it have 320 x 240 px"),
    ("same --fps 30", "have the same number"),
    ("odd --fps 30", "cover.png has no number"),
    ("bag", "bag: this folder contains 0 files"),
    ("bad.db3", "bad.db3: this bag cannot be read"),
    ("bad.mcap", "bad.mcap: this bag cannot be read"),
    ("nowhere.mcap:/image", "nowhere.mcap: there is no such file"),
    ("97", "camera 97: there is no such camera"),
    ("good.mkv right.mkv", "--calibration FILE"),
    ("good.mkv good.mkv --calibration stereo.yaml", "are the same images"),
    ("good.mkv slow.mkv --calibration stereo.yaml", "both cameras must have the same rate"),
    ("good.mkv 97 --calibration stereo.yaml", "camera 97: there is no such camera"),
    ("good.mkv right.mkv --calibration stereo.yaml --offset 99", "have no time in common"),
    ("good.mkv right.mkv --calibration one.yaml", "one.yaml: there is no camera_right"),
    ("small.mkv right.mkv --calibration stereo.yaml", "320 x 240 px, but small.mkv has 160 x 120 px"),
    ("good.mkv --calibration list.yaml --plane board", "list.yaml"),
    ("good.mkv --calibration broken.yaml --plane board", "broken.yaml"),
    ("good.mkv --calibration good.mkv --plane board", "good.mkv"),
    ("good.mkv --calibration one.yaml --plane nan.yaml", "nan.yaml"),
    ("good.mkv --calibration nothing --plane board", "nothing"),
    ("good.mkv --duration 0", "--duration 0: must be above 0"),
    ("good.mkv --duration -3", "--duration -3: must be above 0"),
    ("good.mkv --fps inf", "--fps inf: must be above 0 and finite"),
    ("good.mkv --fps 1e-9", "--fps 1e-09: must be from 0.01"),
    ("good.mkv --height nan", "--height nan: must be a finite number"),
    ("good.mkv --detector '!NormalFlow {stride: 9}'", "stride"),
    ("good.mkv --detector '!FrameDifference {threshold: high}'", "threshold"),
    ("good.mkv --estimator '!CoordinatedTurn {speed_noise: -1}'", "speed_noise"),
    ("good.mkv --estimator '!Custom {call: nowhere.Filter}' --calibration one.yaml --plane board", "nowhere"),
    ("good.mkv --follow 1e400,5", "--follow 1e400,5: must be U,V in pixels"),
    ("good.mkv --roi 0,0,0,0", "width and height must be above 0"),
    ("good.mkv --roi 10,10,5,5 --roi 1,1,5,5", "--roi: 2 given; give one for each camera, here 1"),
    ("good.mkv --objects 99", "--objects 99: must be from 1 to 20"),
    ("good.mkv --detector '!NormalFlow {centroid: mean}' --follow 5,5", "need a detector with centroid: hull"),
    ("good.mkv --height 0.02", "--height 0.02: only with --plane"),
    ("good.mkv --offset 3", "--offset 3: only with two cameras"),
    ("good.mkv --max-gap 0.01", "--max-gap 0.01: only with two cameras"),
    ("good.mkv --camera camera_right", "--camera camera_right: only for a single camera with --calibration FILE"),
    ("good.mkv --detector ''", "--detector '': is empty"),
    ("good.mkv --estimator ' '", "--estimator '': is empty"),
    ("good.mkv --out full", "full"),
    ("good.mkv --out good.mkv", "good.mkv"),
    ("good.mkv --out good.mkv/below", "good.mkv"),
    ("good.mkv --out /proc/nowhere", "/proc/nowhere"),
]


def test_a_missing_extra_is_reported_before_anything_is_written(shelf, monkeypatch, capfd, tmp_path):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert cli.main(["track", str(shelf / "good.mkv"), "--mcap", "--out", str(tmp_path / "out")]) == 2
    assert "pip install 'drake-tracker[mcap]'" in capfd.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(("arguments", "words"), CALLS)
def test_one_line_and_exit_code_2(shelf, monkeypatch, capfd, arguments, words):
    monkeypatch.chdir(shelf)
    before = sorted(path.name for path in shelf.rglob("*"))
    out = [] if "--out" in arguments else ["--out", "out"]
    assert cli.main(["track", *shlex.split(arguments), *out]) == 2
    said = capfd.readouterr().err
    lines = [line for line in said.splitlines() if line]
    assert len(lines) == 1 and lines[0].startswith("drake-tracker: ") and words in lines[0], said
    left = sorted(path.name for path in shelf.rglob("*"))
    if "mixed" in arguments:  # found midway: what was tracked is kept
        shutil.rmtree(shelf / "out")
    else:
        assert left == before
