"""Tests of recordings that were converted to a higher rate."""

from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.copies import without_copies
from drake_tracker.footage.footage import Footage


def converted(shown, rate=30.0, noise=0, seed=0):
    """A recording that shows the captured images ``shown``, a sequence of numbers, at a rate [images/s]."""
    rng = np.random.default_rng(seed)
    pictures = {number: rng.integers(0, 256, (12, 16, 3), np.uint8) for number in set(shown)}
    times = np.arange(len(shown)) / rate

    def frames():
        for time, number in zip(times, shown):
            yield time, np.clip(pictures[number].astype(int) + rng.integers(0, noise + 1), 0, 255).astype(np.uint8)

    return Footage("a.mp4", (16, 12), frames, times)


@pytest.mark.parametrize(
    ("shown", "rate", "true_rate"),
    [
        (np.repeat(np.arange(60), 2), 60.0, "30"),  # each image twice
        (np.repeat(np.arange(50), 3), 60.0, "20"),  # each three times
        (np.floor(np.arange(120) * 0.8).astype(int), 30.0, "30"),  # 24 to 30 images/s: the median step is unchanged
        (np.floor(np.arange(120) * 25 / 30).astype(int), 30.0, "30"),
    ],
)
def test_copies_are_left_out_and_reported(shown, rate, true_rate):
    found = without_copies(converted(shown.tolist(), rate, noise=1))
    first = np.flatnonzero(np.diff(shown, prepend=-1))
    np.testing.assert_allclose(found.times, first / rate)
    assert [time for time, _ in found.frames()] == pytest.approx((first / rate).tolist())
    copies = len(shown) - len(first)
    assert found.warning() == f"a.mp4: {copies} of {len(shown)} images are copies; the camera took {true_rate} images/s"


@pytest.mark.parametrize(
    "shown",
    [
        list(range(120)),
        [*range(30), *[30] * 60, *range(31, 61)],  # at rest in between
        [k if k % 20 else k - 1 for k in range(1, 121)],  # few images of a slow computer
        [0] * 120,
    ],
)
def test_other_recordings_are_kept(shown):
    footage = converted(shown)
    assert without_copies(footage) is footage


def test_live_cameras_are_kept():
    footage = converted(np.repeat(np.arange(60), 2).tolist())
    for live in (replace(footage, times=None), replace(footage, rate=30.0)):
        assert without_copies(live) is live


def test_an_earlier_warning_is_kept():
    footage = replace(converted(np.repeat(np.arange(60), 2).tolist()), warning=lambda: "2 images are damaged")
    assert without_copies(footage).warning().startswith("2 images are damaged; a.mp4: 60 of 120")


def test_a_damaged_recording_is_kept_for_the_track_to_report():
    footage = converted(np.repeat(np.arange(60), 2).tolist())

    def frames():
        yield from list(footage.frames())[:50]
        raise DrakeTrackerError("a.mp4: image 51 is damaged")

    damaged = replace(footage, frames=frames)
    assert without_copies(damaged) is damaged


def test_a_recording_without_any_image_is_kept():
    footage = replace(converted(range(60)), frames=lambda: iter(()))
    assert without_copies(footage) is footage
