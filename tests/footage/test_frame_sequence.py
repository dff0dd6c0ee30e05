import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import FrameInfo
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.frame_clock import FrameClock
from drake_tracker.footage.frame_sequence import FrameSequence
from drake_tracker.footage.timeline import align
from drake_tracker.footage.video_source_system import VideoSource

PERIOD = 0.1


def images(numbers):
    """Images whose grey is their number, taken 1 ms late."""
    for number in numbers:
        yield number * PERIOD + 0.001, np.full((4, 6, 3), number, np.uint8)


def footage(numbers, *, start=0, live=False, epoch=None, name="a", rate=None):
    numbers = list(numbers)
    times = (np.array(numbers) - start) * PERIOD
    return Footage(
        name,
        (6, 4),
        lambda: ((time, np.full((4, 6, 3), number, np.uint8)) for number, time in zip(numbers, times)),
        None if live else times,
        epoch,
        rate,
    )


def test_each_tick_has_its_image_or_none():
    source = Footage("a", (6, 4), lambda: images([0, 1, 4, 5]), np.zeros(4))
    sequence = FrameSequence(source, FrameClock(PERIOD), zero=0.0)
    seen = [sequence.at(k) for k in range(8)]
    assert [tick.fresh for tick in seen] == [True, True, False, False, True, True, False, False]
    assert [int(tick.image[0, 0, 0]) for tick in seen] == [0, 1, 1, 1, 4, 5, 5, 5]
    np.testing.assert_allclose([tick.stamp for tick in seen], [0.001, 0.101, 0.2, 0.3, 0.401, 0.501, 0.6, 0.7])
    assert sequence.at(7) is sequence.at(7)
    assert int(sequence.at(1).image[0, 0, 0]) == 1  # begins anew


def test_a_live_camera_cannot_be_rewound():
    sequence = FrameSequence(footage(range(9), live=True), FrameClock(PERIOD))
    sequence.at(3)
    with pytest.raises(DrakeTrackerError, match="cannot be rewound"):
        sequence.at(2)


def test_the_source_shows_images_and_stamps_at_their_ticks():
    sequence = FrameSequence(Footage("a", (6, 4), lambda: images([0, 2, 3]), np.zeros(3)), FrameClock(PERIOD), zero=0.0)
    source = VideoSource(sequence, PERIOD)
    simulator = Simulator(source)
    shown = []
    for number in range(4):
        simulator.AdvanceTo(number * PERIOD + 0.3 * PERIOD)
        context = simulator.get_context()
        frame = FrameInfo(source.GetOutputPort("frame").Eval(context))
        pixel = source.GetOutputPort("image").Eval(context).data[0, 0]
        grey = source.GetOutputPort("grey").Eval(context).data[0, 0, 0]
        shown.append((int(pixel[0]), int(pixel[3]), int(grey), bool(frame.fresh)))
    assert shown == [(0, 255, 0, True), (0, 255, 0, False), (2, 255, 2, True), (3, 255, 3, True)]


def test_recordings_with_their_own_clocks_begin_together_or_an_offset_apart():
    left, right = footage(range(20)), footage(range(20), name="b")
    line = align([left, right])
    assert (line.count, line.period) == (20, pytest.approx(PERIOD))
    assert [int(each.at(7).image[0, 0, 0]) for each in line.sequences] == [7, 7]
    line = align([left, right], offset=0.22, duration=1.5)
    assert line.count == 15
    seen = [each.at(7) for each in line.sequences]
    assert [int(tick.image[0, 0, 0]) for tick in seen] == [7, 5]
    assert [tick.stamp for tick in seen] == pytest.approx([0.7, 0.72])


def test_a_shared_clock_is_kept():
    left, right = footage(range(20), epoch=1e9), footage(range(3, 18), start=3, epoch=1e9 + 0.3, name="b")
    line = align([left, right])
    assert line.count == 18
    seen = [each.at(9) for each in line.sequences]
    assert [int(tick.image[0, 0, 0]) for tick in seen] == [9, 9]
    assert seen[0].stamp == pytest.approx(seen[1].stamp, abs=1e-5)
    assert not line.sequences[1].at(2).fresh


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (footage(range(25), name="b"), r"a lasts 2.00 s and b ends after 2.50 s; .* --duration 2"),
        (footage(range(20), live=True, rate=10.0, name="b"), "a and b: one is live"),
        (footage(range(0, 40, 2), name="b"), "a has 10.00 images per second, b has 5.00"),
        (footage(range(20), epoch=500.0, name="b"), "no time in common"),
    ],
)
def test_two_that_do_not_fit_are_refused_in_one_line(other, message):
    with pytest.raises(DrakeTrackerError, match=message) as caught:
        align([footage(range(20), epoch=0.0), other])
    assert "\n" not in str(caught.value)


def test_unequal_lengths_are_no_matter_within_a_duration_that_both_have():
    assert align([footage(range(20)), footage(range(25), name="b")], duration=1.8).count == 18
