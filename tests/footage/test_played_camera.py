"""A recording that is played as if it were a camera."""

from itertools import islice

import numpy as np
import pytest
from films import film, write_video
from played import Clock, play_at_once

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.played_camera import Start, open_played
from drake_tracker.footage.sources import open_footage

TIMES = np.arange(12) / 25.0


def recording(name="left", times=TIMES):
    images = [np.full((24, 32, 3), k, np.uint8) for k in range(len(times))]
    return Footage(name, (32, 24), lambda: iter(zip(times.tolist(), images)), times)


def test_it_plays_at_its_own_pace_and_ends():
    clock = Clock()
    live = open_played(recording(), "play:left", clock=clock, sleep=clock.sleep)
    assert live.live and live.rate == pytest.approx(25.0) and live.name == "play:left"
    played = list(live.frames())
    assert np.allclose([time for time, _ in played], TIMES)
    assert [image[0, 0, 0] for _, image in played] == list(range(12))


def test_images_that_nobody_reads_in_time_are_dropped():
    clock = Clock()
    live = open_played(recording(), "play:left", clock=clock, sleep=clock.sleep)
    seen = []
    for time, image in live.frames():
        seen.append((time, image[0, 0, 0]))
        if len(seen) == 3:
            clock.sleep(0.17)  # busy for more than four images
    numbers = [number for _, number in seen]
    assert numbers == [0, 1, 2, 6, 7, 8, 9, 10, 11]
    assert seen[3][0] == pytest.approx(0.25)  # when it was read, as with a camera, not when it was due


def test_two_of_them_show_the_same_moment():
    clock, start = Clock(), Start()
    left = open_played(recording(), "left", start, clock=clock, sleep=clock.sleep)
    clock.sleep(0.13)  # the second one is opened later
    right = open_played(recording("right"), "right", start, clock=clock, sleep=clock.sleep)
    late = []
    for pair in zip(left.frames(), right.frames(), strict=False):  # as two cameras are read, in turn
        for each, (time, image) in zip((left, right), pair):
            late.append(each.epoch + time - 1000.0 - float(image[0, 0, 0]) / 25.0)
    assert len(late) > 12 and min(late) > -1e-6 and max(late[2:]) < 1e-6


def test_it_can_be_unplugged():
    clock = Clock()
    live = open_played(recording(), "play:left", clock=clock, sleep=clock.sleep, most=5)
    frames = live.frames()
    assert [image[0, 0, 0] for _, image in islice(frames, 5)] == list(range(5))
    with pytest.raises(DrakeTrackerError, match="play:left: it delivers no more images"):
        next(frames)


def test_a_source_is_played_by_its_name(tmp_path, monkeypatch):
    play_at_once(monkeypatch)
    times = np.arange(10) / 30.0
    name = write_video(tmp_path / "left.mkv", film("left", times), times)
    live = open_footage(f"play:{name}")
    assert live.live and len(list(live.frames())) == 10
    for wrong, words in (("play:none.mp4", "none.mp4: there is no such file"), ("play:99", "camera 99")):
        with pytest.raises(DrakeTrackerError, match=words):
            open_footage(wrong)
