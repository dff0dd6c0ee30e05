"""Recordings of live cameras are without loss, with the exact times, and survive the end of a process."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.recording import FootageRecorder, find_recordings, is_recording, open_recording
from drake_tracker.footage.sources import open_footage
from drake_tracker.footage.timeline import align


def live(count=40, rate=30.0, size=(34, 26)):
    rng = np.random.default_rng(4)
    images = rng.integers(0, 256, (count, *size[::-1], 3), dtype=np.uint8)
    times = (np.arange(count) / rate + rng.uniform(0.0, 0.004, count)).tolist()
    times[0] = 0.0
    return Footage("camera 0", size, lambda: zip(times, images), epoch=1.7e9 + 0.125, rate=rate), times, images


def record(path, **options):
    footage, times, images = live(**options)
    recording = FootageRecorder(footage)
    recording.begin(path)
    list(recording.footage.frames())
    recording.close()
    recording.close()
    return footage, times, images


@pytest.mark.parametrize("rate", [7.5, 30.0, 240.0])
def test_a_recording_has_the_same_images_times_and_clock(tmp_path, rate):
    footage, times, images = record(tmp_path / "recording" / "camera_left", rate=rate)
    again = open_recording(tmp_path / "recording" / "camera_left.mkv")
    assert not again.live and again.times.tolist() == times
    assert (again.epoch, again.rate, again.size) == (footage.epoch, footage.rate, footage.size)
    replayed = list(again.frames())
    assert [time for time, _ in replayed] == times
    assert np.array_equal([image for _, image in replayed], images)
    assert align([again]).period == align([footage]).period


def test_a_recording_is_found_by_its_folder_or_that_of_its_track(tmp_path):
    record(tmp_path / "recording" / "camera_left")
    record(tmp_path / "recording" / "camera_right")
    videos = [str(tmp_path / "recording" / f"camera_{side}.mkv") for side in ("left", "right")]
    assert find_recordings(str(tmp_path)) == find_recordings(str(tmp_path / "recording")) == videos
    assert find_recordings(str(tmp_path.parent)) is None and find_recordings("0") is None
    assert open_footage(videos[0]).rate == 30.0 and is_recording(videos[1])


@pytest.mark.parametrize(
    "text",
    [
        *("", "time\n0.0\n", "# {}\ntime\n0\n", '# {"rate": 30, "epoch": 0}\ntime\n1\n0\n\n', "# [" * 5000),
        f'# {{"rate": 30, "epoch": 1{"0" * 400}}}\ntime\n0\n1\n',
    ],
)
def test_a_wrong_table_of_times_is_named(tmp_path, text):
    record(tmp_path / "camera_left", count=5)
    (tmp_path / "camera_left.csv").write_text(text)
    with pytest.raises(DrakeTrackerError, match="camera_left.csv: "):
        open_recording(tmp_path / "camera_left.mkv")


def test_only_a_live_camera_is_recorded(tmp_path):
    record(tmp_path / "camera_left", count=5)
    with pytest.raises(DrakeTrackerError, match=r"--record: .*camera_left.mkv is not a live camera"):
        FootageRecorder(open_recording(tmp_path / "camera_left.mkv"))
    footage, _, _ = live(count=3)
    (tmp_path / "file").write_text("")
    with pytest.raises(DrakeTrackerError, match="cannot be written"):
        FootageRecorder(footage).begin(tmp_path / "file" / "camera_left")


ENDLESS = """
import itertools, sys, time
from pathlib import Path
import numpy as np
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.recording import FootageRecorder
image = np.random.default_rng(0).integers(0, 256, (48, 64, 3), dtype=np.uint8)
frames = lambda: ((k / 30, np.roll(image, k)) for k in itertools.count())
recording = FootageRecorder(Footage("camera 0", (64, 48), frames, epoch=0.0, rate=30.0))
recording.begin(Path(sys.argv[1]))
for time_, _ in recording.footage.frames():
    time.sleep(0.002)
    if time_ > 4.0:
        print("running", flush=True)
"""


def test_a_recording_survives_a_killed_process(tmp_path):
    command = [sys.executable, "-c", ENDLESS, str(tmp_path / "camera_left")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
    assert process.stdout.readline() == b"running\n"
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    again = open_recording(tmp_path / "camera_left.mkv")
    replayed = list(again.frames())
    assert len(replayed) > 60 and [time for time, _ in replayed] == (np.arange(len(replayed)) / 30).tolist()
    image = np.random.default_rng(0).integers(0, 256, (48, 64, 3), dtype=np.uint8)
    assert all(np.array_equal(shown, np.roll(image, k)) for k, (_, shown) in enumerate(replayed))
