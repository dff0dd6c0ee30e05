"""Photographs of live cameras, for their calibration."""

import cv2
import numpy as np
import pytest
from films import film, write_video
from played import play_at_once

from drake_tracker import cli

TIMES = np.arange(90) / 30.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for side in ("left", "right"):
        write_video(tmp_path / f"{side}.mkv", film(side, TIMES), TIMES)
    return tmp_path


def photograph(*arguments):
    return cli.main(["photograph", *arguments])


def test_each_pair_shows_one_moment(folder, monkeypatch, capsys):
    play_at_once(monkeypatch)
    assert photograph("play:left.mkv", "play:right.mkv", "-o", "shots", "--every", "0.5", "--count", "4") == 0
    assert {path.name for path in (folder / "shots").iterdir()} == {
        f"{side}{number:02d}.png" for side in ("left", "right") for number in range(1, 5)
    }
    assert "photograph 4 of 4" in capsys.readouterr().out
    for side in ("left", "right"):
        expected = film(side, TIMES)
        for number in range(1, 5):
            shot = cv2.imread(str(folder / "shots" / f"{side}{number:02d}.png"), cv2.IMREAD_GRAYSCALE).astype(float)
            nearest = int(np.argmin([np.abs(shot - image).mean() for image in expected]))
            assert nearest in (15 * number, 15 * number + 1)


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["left.mkv"], "left.mkv is not a live camera"),
        (["0", "1", "2"], "3 cameras; give one or two"),
        (["0", "0"], "0 is given twice"),
        (["99"], "camera 99: there is no such camera"),
        (["0", "--every", "0"], "--every 0: must be from"),
        (["0", "--count", "0"], "--count 0: must be from 1 to 99"),
        (["play:left.mkv", "--count", "20", "--every", "0.5"], "it ended after 5 photographs; they are kept"),
    ],
)
def test_wrong_calls_say_one_line(folder, monkeypatch, capfd, arguments, words):
    play_at_once(monkeypatch)
    assert photograph(*arguments, "-o", "shots") == 2
    printed = capfd.readouterr().err
    said = [line for line in printed.splitlines() if line.startswith("drake-tracker: ")]
    assert len(said) == 1 and words in said[0] and "Traceback" not in printed


def test_photographs_of_an_earlier_time_are_not_mixed_with_new_ones(folder, monkeypatch, capfd):
    play_at_once(monkeypatch)
    (folder / "shots").mkdir()
    (folder / "shots" / "left07.png").write_text("")
    assert photograph("play:left.mkv", "-o", "shots") == 2
    assert "shots: contains left07.png already" in capfd.readouterr().err
    (folder / "file").write_text("")
    assert photograph("play:left.mkv", "-o", "file") == 2
    assert "file: cannot be created: File exists" in capfd.readouterr().err
