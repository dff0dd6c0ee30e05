import subprocess
import sys

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.background_difference import BackgroundDifferenceDetector
from drake_tracker.vision.centroid.config import BackgroundDifference, FrameDifference, NormalFlow
from drake_tracker.vision.centroid.detectors import DETECTORS, make_detector

SCENE = np.random.default_rng(0).integers(0, 255, (20, 30, 3), np.uint8)


@pytest.mark.parametrize("kind", DETECTORS.makers)
def test_every_detector_has_the_members_of_the_protocol(kind):
    detector = make_detector(kind(), window=np.ones((20, 30)), image=SCENE)
    images = [detector.smooth(SCENE[..., 0])] * detector.buffer_length
    used = images[:: detector.stride]
    assert detector.stamp_age_cycles <= detector.buffer_length - 1
    assert detector.mask(*used).shape == detector.images(*used).motion_energy.shape == (20, 30)


def test_settings_with_what_a_reader_could_not_read_are_made_and_only_a_detector_refuses_them():
    for settings in (NormalFlow(preset=None), FrameDifference(threshold=None), FrameDifference(smoothing_size=4)):
        with pytest.raises(DrakeTrackerError, match="preset is None|threshold is None|must be odd"):
            make_detector(settings)


def test_an_image_of_the_empty_scene_is_needed_by_one_detector_alone():
    with pytest.raises(DrakeTrackerError, match="image of the empty scene"):
        make_detector(BackgroundDifference())
    grey = BackgroundDifferenceDetector(image=np.full((4, 5), 90, np.uint8))
    assert not grey.mask(np.full((4, 5), 90, np.uint8)).any()


def test_a_detector_is_made_by_name():
    assert DETECTORS.make_by_name("normal_flow", stride=1, period=0.02).parameters.span == pytest.approx(0.04)
    with pytest.raises(DrakeTrackerError, match="allowed are background_difference, frame_difference"):
        DETECTORS.make_by_name("eye")


def test_reading_settings_loads_neither_opencv_nor_drake():
    loaded = "print([m for m in ('cv2', 'pydrake', 'scipy') if m in sys.modules])"
    code = f"import sys, drake_tracker.vision.centroid.detectors\n{loaded}"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
