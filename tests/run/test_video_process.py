"""Tests of the video that another process draws and encodes."""

import os
import signal
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.core.processes import child_process
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.drawn_video import DrawnVideo
from drake_tracker.run.video_page import CameraSight, PageState, VideoPage
from drake_tracker.run.video_process import VideoProcess

WINDOW = np.array([[20.0, 30.0], [80.0, 30.0], [80.0, 70.0]])
PATIENCE = 30.0


def page():
    return VideoPage({"": WINDOW}, (160, 120), "train", "seed 0", 0.25)


def write_frames(video, count):
    for k in range(count):
        image = np.full((120, 160, 3), 5 * k % 256, np.uint8)
        sight = CameraSight(image, (0, 0), np.array([[40.0 + k, 50.0]]), image, image[..., 0], (40.0, 50.0))
        video.write({"": sight}, PageState(k / 30, Phase.TRACK, ("note", str(k)), k / 30))


def complete(video, count):
    write_frames(video, count)
    video.close()


def read(path):
    video, found = cv2.VideoCapture(str(path)), []
    while (frame := video.read())[0]:
        found.append(frame[1])
    return np.array(found)


def ended(number):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            os.kill(number, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    return False


def test_the_file_is_the_one_that_this_process_would_write(tmp_path):
    for kind, name in ((DrawnVideo, "here.mp4"), (VideoProcess, "there.mp4")):
        video = kind(tmp_path / name, page())
        complete(video, 40)
        video.close()
    here, there = read(tmp_path / "here.mp4"), read(tmp_path / "there.mp4")
    assert len(here) == 40 and len(np.unique(here[0])) > 50
    np.testing.assert_array_equal(here, there)
    assert ended(video.running[0]) and sorted(os.listdir(tmp_path)) == ["here.mp4", "there.mp4"]


def test_a_file_that_cannot_be_written_is_named_once():
    video = VideoProcess("/dev/full", page())
    with pytest.raises(DrakeTrackerError, match="^/dev/full: cannot be written: No space left") as error:
        complete(video, 400)
    assert not isinstance(error.value, MachineError)
    complete(video, 2)
    assert ended(video.running[0])


def test_a_killed_process_is_named_in_one_line_and_the_written_part_is_kept(tmp_path):
    video = VideoProcess(tmp_path / "v.mp4", page())
    write_frames(video, 100)
    end = time.monotonic() + PATIENCE
    while not ((tmp_path / "v.mp4").exists() and (tmp_path / "v.mp4").stat().st_size > 5000):
        assert time.monotonic() < end
        time.sleep(0.02)
    os.kill(video.running[0], signal.SIGKILL)
    with pytest.raises(MachineError, match="^a video process was ended by signal 9; [^\n]*render_processes 0$"):
        video.close()
    assert len(read(tmp_path / "v.mp4")) >= 25


def test_a_process_that_cannot_start_is_named_in_one_line(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    video = VideoProcess(tmp_path / "v.mp4", page())
    with pytest.raises(MachineError, match="^a video process cannot start: No such file"):
        write_frames(video, 1)
    complete(video, 1)
    assert video.running == [] and not list(tmp_path.iterdir())


def test_without_a_frame_there_is_no_process_and_no_file(tmp_path):
    video = VideoProcess(tmp_path / "v.mp4", page())
    video.close()
    assert video.running == [] and not list(tmp_path.iterdir())


def test_a_stopped_process_does_not_stop_this_one(monkeypatch, tmp_path):
    monkeypatch.setattr(child_process, "PATIENCE", 0.3)
    video = VideoProcess(tmp_path / "v.mp4", page())
    write_frames(video, 1)
    os.kill(video.running[0], signal.SIGSTOP)
    with pytest.raises(MachineError, match=r"^a video process did not answer within 0\.3 s; [^\n]*$"):
        complete(video, 200)
    assert ended(video.running[0])


def test_the_file_is_completed_when_the_simulation_is_killed(tmp_path):
    """It is one piece with its index in front, not fragments."""
    program = (
        "import sys, time; sys.path.insert(0, sys.argv[1]); "
        "from test_video_process import VideoProcess, page, write_frames; "
        "video = VideoProcess(sys.argv[2], page()); write_frames(video, 20); print(*video.running, flush=True); "
        "time.sleep(60)"
    )
    path = tmp_path / "v.mp4"
    here = os.path.dirname(__file__)
    child = subprocess.Popen([sys.executable, "-c", program, here, path], stdout=subprocess.PIPE, text=True)
    number = int(child.stdout.readline())
    end = time.monotonic() + PATIENCE
    while not path.exists() or path.stat().st_size == 0:
        assert time.monotonic() < end
        time.sleep(0.02)
    time.sleep(1.0)
    child.kill()
    child.wait()
    child.stdout.close()
    assert ended(number) and len(read(path)) >= 1
    assert b"moof" not in path.read_bytes()
