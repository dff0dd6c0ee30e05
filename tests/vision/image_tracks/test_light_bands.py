"""Lamps that flicker under a rolling shutter draw bands across the image, and an object is measured as without them."""

import cv2
import numpy as np
import pytest

from drake_tracker.vision.centroid.config import FrameDifference, NormalFlow
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker
from drake_tracker.vision.light_gain import with_light_of

PERIOD = 1.0 / 30.0
SHAPE = (240, 320)


def texture(seed=2):
    rng = np.random.default_rng(seed)
    return 110.0 + 20.0 * cv2.resize(rng.normal(size=(24, 32)), SHAPE[::-1], interpolation=cv2.INTER_CUBIC)


def lit(image, gains, axis, seed):
    """Returns an image whose rows (axis 1) or columns (axis 0) are lit by lamps of different brightness."""
    noisy = image * np.expand_dims(gains, axis) + np.random.default_rng(seed).normal(0.0, 1.5, image.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def bands(count, amplitude, period, phase):
    return 1.0 + amplitude * np.sin(2.0 * np.pi * (np.arange(count) / period + phase))


@pytest.mark.parametrize(("amplitude", "period", "axis"), [(0.0, 80, 1), (0.1, 80, 1), (0.2, 150, 1), (0.15, 240, 0)])
@pytest.mark.parametrize("settings", [NormalFlow(stride=1), FrameDifference(stride=1)])
def test_an_object_is_measured_as_in_steady_light(settings, amplitude, period, axis):
    """Bands of 10 % put the point 16 px beside the object, or the object was lost."""
    detector, tracker = make_detector(settings, period=PERIOD), ImageTracker(period=PERIOD)
    objects, smoothed, off = tracker.start(), [], []
    for k in range(45):
        image, u, v = texture(), 60.0 + 3.0 * k, 120.0 + 40.0 * np.sin(k / 15)
        cv2.circle(image, (round(u * 16), round(v * 16)), 18 * 16, 225, -1, cv2.LINE_AA, 4)
        image = lit(image, bands(SHAPE[1 - axis], amplitude, period, 0.33 * k), axis, k)
        smoothed.append(detector.smooth(image))
        used = smoothed[-detector.buffer_length :: detector.stride]
        if len(smoothed) < detector.buffer_length:
            continue
        age = detector.stamp_age_cycles
        objects, _, centroid = tracker.update(objects, (k - age) * PERIOD, detector, used)
        if k >= 8:
            off.append(np.hypot(centroid.u - u + 3.0 * age, centroid.v - 120.0 - 40.0 * np.sin((k - age) / 15)))
    assert np.median(off) < 1.0 and max(off) < 3.0
    assert objects.targets == (1,)


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float64])
@pytest.mark.parametrize("axis", [0, 1])
def test_bands_are_scaled_to_the_light_of_the_other_image(axis, kind):
    scale = 32 if kind is np.int16 else 1
    images = [lit(texture(), bands(SHAPE[1 - axis], 0.12, 90, phase), axis, 1) for phase in (0.0, 0.4)]
    first, second = (cv2.GaussianBlur(each, (5, 5), 1.2).astype(kind) * kind(scale) for each in images)
    same = with_light_of(first, second)
    assert same.dtype == first.dtype
    before, after = (np.abs(each / scale - first / scale).mean() for each in (second, same))
    assert before > 10.0 and after < 1.0


def test_images_without_bands_are_left_alone():
    """A wide object that moves across the lines, a moving camera, and lamps that flicker as a whole are no bands."""
    first = lit(texture(), np.ones(SHAPE[0]), 1, 1)
    wide = [first.copy(), first.copy()]
    for k, image in enumerate(wide):
        image[60 + 12 * k : 120 + 12 * k, 10:310] = 230
    assert with_light_of(*wide) is wide[1]
    moved = np.roll(first, 9, axis=1)
    assert with_light_of(first, moved) is moved
    bright = lit(texture(), np.full(SHAPE[0], 1.2), 1, 2)
    assert with_light_of(first, bright) is bright
    dark = np.zeros(SHAPE, np.uint8)
    assert with_light_of(dark, dark) is dark
