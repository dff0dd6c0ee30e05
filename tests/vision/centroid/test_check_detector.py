"""Tests of the rules that a detector of one's own must follow."""

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.config import FrameDifference, NormalFlow
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.centroid.motion_detector import check_detector


@pytest.mark.parametrize("settings", [NormalFlow(), FrameDifference()])
def test_the_detectors_of_the_package_follow_the_rules(settings):
    check_detector(make_detector(settings, period=1 / 60))


class Difference:
    stride, buffer_length, stamp_age_cycles = 1, 2, 0.5

    def smooth(self, grey):
        return grey

    def mask(self, *images):
        return np.where(images[0] != images[1], 255, 0).astype(np.uint8)

    def centroid(self, mask):
        return None

    def images(self, *images):
        return None


class Counts(Difference):
    count = 0

    def mask(self, *images):
        self.count += 1
        return super().mask(*images) if self.count == 1 else np.zeros_like(images[0])


class Paints(Difference):
    def mask(self, *images):
        images[0][:] = 0
        return np.zeros_like(images[0])


class Floats(Difference):
    def mask(self, *images):
        return super().mask(*images) / 255.0


class Ones(Difference):
    def mask(self, *images):
        return super().mask(*images) // 255


class Strides(Difference):
    stride = 3


class Breaks(Difference):
    def smooth(self, grey):
        return grey.nothing


@pytest.mark.parametrize(
    ("detector", "message"),
    [
        (Counts(), "Counts.mask gave another mask for the same images; a detector has no memory"),
        (Paints(), "Paints.mask changed the images"),
        (Floats(), r"Floats.mask must return uint8 of the images' shape \(48, 64\)"),
        (Ones(), "Ones.mask returned other values than 0 and 255"),
        (Strides(), "Strides: stride 3, buffer_length 2"),
        (Breaks(), "Breaks raised AttributeError: .*nothing"),
        (object(), "object has no stride, buffer_length"),
    ],
)
def test_a_detector_that_breaks_a_rule_is_named(detector, message):
    with pytest.raises(DrakeTrackerError, match=f"^{message}"):
        check_detector(detector)


def test_a_detector_of_ones_own_passes():
    check_detector(Difference())
