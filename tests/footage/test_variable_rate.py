"""Tests of recordings whose rate varies."""

import numpy as np
import pytest

from drake_tracker.footage.footage import Footage
from drake_tracker.footage.timeline import align


def recording(times, name="a.mp4"):
    def frames():
        for number, time in enumerate(times):
            yield time, np.full((4, 6, 3), number % 256, np.uint8)

    return Footage(name, (6, 4), frames, np.array(times))


def halved(first=60, second=60):
    """30 images/s, then 15 images/s."""
    return np.concatenate([np.arange(first) / 30, first / 30 + np.arange(second) / 15])


def ticks(line):
    return [[each.at(k) for k in range(line.count)] for each in line.sequences]


def points(seen):
    """Number of ticks in the middle of three with images."""
    fresh = np.array([tick.fresh for tick in seen])
    return int((fresh[:-2] & fresh[1:-1] & fresh[2:]).sum())


def test_a_camera_that_halves_its_rate_gives_points_from_then_on():
    times = halved()
    line = align([recording(times)])
    assert line.period == pytest.approx(1 / 15, rel=1e-3)
    (seen,) = ticks(line)
    assert points(seen) > 0.95 * line.count
    # Each tick has the image nearest to it, with the time at which it was captured.
    assert all(tick.stamp in times for tick in seen if tick.fresh)
    np.testing.assert_allclose([tick.stamp for tick in seen], np.arange(line.count) / 15, atol=0.5 / 30)
    assert line.notes == (
        "a.mp4: the rate varies from 15 to 30 images/s, for the first time at 2.00 s; 15 images/s are used",
    )


def test_a_rate_that_wanders_and_one_that_rises():
    rates = 30 - 6 * np.sin(np.arange(200) / 15) ** 2
    for times in (np.concatenate([[0.0], np.cumsum(1 / rates)]), halved()[-1] - halved()[::-1]):
        line = align([recording(times)])
        (seen,) = ticks(line)
        assert points(seen) > 0.85 * line.count and line.period > 1.05 / 30


def test_two_cameras_of_which_one_slows_down():
    times = halved()
    even = np.arange(round(30 * times[-1]) + 1) / 30
    line = align([recording(even, "left.mp4"), recording(times, "right.mp4")])
    left, right = ticks(line)
    assert points(left) > 0.95 * line.count and points(right) > 0.95 * line.count
    assert max(abs(a.stamp - b.stamp) for a, b in zip(left, right)) < 0.5 / 30 + 1e-6
    assert [note.split(":")[0] for note in line.notes] == ["right.mp4"]


@pytest.mark.parametrize("lost", [[], [20, 50], list(range(40, 50))])
def test_a_regular_recording_keeps_its_clock(lost):
    times = np.delete(np.arange(150) / 30, lost)
    line = align([recording(times)])
    assert line.period == pytest.approx(1 / 30, rel=1e-6) and line.notes == ()


def test_every_tenth_image_lost_keeps_the_clock():
    times = np.delete(np.arange(150) / 30, np.arange(9, 150, 10))
    assert align([recording(times)]).period == pytest.approx(1 / 30, rel=1e-3)


def test_stamps_begin_with_the_first_image():
    """A line that is fitted to the times of a variable rate misses the first one."""
    times = 100.0 + np.concatenate([np.arange(100) / 29.0, 100 / 29.0 + np.arange(100) / 31.0])
    seen = align([recording(times)]).sequences[0].at(0)
    assert seen.stamp == 0.0
