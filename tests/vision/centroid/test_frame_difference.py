import math

import numpy as np
import pytest
from ball_pictures import FROM_CAMERA, FROM_SIDE, put_ball, shoot

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.background_difference import BackgroundDifferenceDetector
from drake_tracker.vision.centroid.config import BackgroundDifference, FrameDifference, StaticThreshold
from drake_tracker.vision.centroid.frame_difference import DifferenceImages, FrameDifferenceDetector
from drake_tracker.vision.centroid.static_threshold import StaticThresholdDetector

BOARD = np.full((160, 160), 205.0)
MIDDLE = np.array([80.0, 80.0])


def find(detector, *images):
    return detector.centroid(detector.mask(*(detector.smooth(image) for image in images)))


def errors(displacement, light, count=30, **settings):
    """Centroids' errors (n, 2) [px] from the midpoint of a ball's two places, ``displacement`` [px] apart."""
    detector = FrameDifferenceDetector(FrameDifference(**settings))
    rng = np.random.default_rng(3)
    found = []
    for _ in range(count):
        angle, midpoint = rng.uniform(0.0, 2.0 * math.pi), MIDDLE + rng.uniform(-20.0, 20.0, 2)
        step = displacement / 2 * np.array([math.cos(angle), math.sin(angle)])
        pair = (shoot(put_ball(BOARD, midpoint + sign * step, light=light), rng) for sign in (-1.0, 1.0))
        region = find(detector, *pair)
        found.append((np.nan, np.nan) if region is None else np.array(region[:2]) - midpoint)
    return np.array(found)


@pytest.mark.parametrize("centroid", ["mean", "hull"])
@pytest.mark.parametrize("displacement", [2.0, 4.0, 8.0])
def test_the_centroid_of_a_white_ball_on_white_is_midway_between_its_two_places(displacement, centroid):
    error = errors(displacement, FROM_CAMERA, centroid=centroid, threshold=6.0)
    assert np.sqrt(np.mean(error**2)) < 0.3  # per axis
    assert np.abs(error.mean(axis=0)).max() < 0.12


@pytest.mark.parametrize("displacement", [2.0, 4.0, 8.0])
def test_shading_from_one_side_shifts_the_hull_by_little_and_the_mean_by_more(displacement):
    hull, mean = (errors(displacement, FROM_SIDE, centroid=name) for name in ("hull", "mean"))
    assert np.sqrt(np.mean(hull**2)) < 0.6  # per axis
    assert hull.std(axis=0).max() < 0.2  # the same shift every time
    assert np.linalg.norm(hull.mean(axis=0)) < 0.95 * np.linalg.norm(mean.mean(axis=0))


@pytest.mark.parametrize("stride", [1, 2])
def test_the_stamp_is_midway_between_the_captures(stride):
    detector = FrameDifferenceDetector(FrameDifference(stride=stride))
    assert (detector.stride, detector.buffer_length, detector.stamp_age_cycles) == (stride, stride + 1, stride / 2)


def test_a_ball_at_rest_does_not_show():
    rng = np.random.default_rng(0)
    ball = put_ball(BOARD, MIDDLE, light=FROM_SIDE)
    assert find(FrameDifferenceDetector(), shoot(ball, rng), shoot(ball, rng)) is None


def test_a_plain_threshold_cannot_find_white_on_white():
    rng = np.random.default_rng(1)
    place = (40.0, 50.0)
    same_white = shoot(put_ball(BOARD, place, white=205.0), rng)
    for level in range(5, 250, 5):
        region = find(StaticThresholdDetector(StaticThreshold(level=level)), same_white)
        assert region is None or math.dist(region[:2], place) > 20.0
    # On a dark board it does.
    region = find(StaticThresholdDetector(StaticThreshold(level=120)), shoot(put_ball(0.3 * BOARD, place), rng))
    assert math.dist(region[:2], place) < 0.3
    # And motion does on the white one, by the ball's darker rim.
    pair = (shoot(put_ball(BOARD, (x, 50.0), white=205.0), rng) for x in (37.0, 43.0))
    assert math.dist(find(FrameDifferenceDetector(), *pair)[:2], place) < 0.5


def test_flicker_breaks_the_background_difference_and_not_that_of_sequential_images():
    """A light that has become 4 % stronger since the static image was taken, and 0.4 % from image to image."""
    rng = np.random.default_rng(2)
    places = MIDDLE - (3.0, 0.0), MIDDLE + (3.0, 0.0)
    static = BackgroundDifferenceDetector(BackgroundDifference(threshold=6.0), image=shoot(BOARD, rng))
    steady = find(static, shoot(put_ball(BOARD, MIDDLE), rng))
    assert math.dist(steady[:2], MIDDLE) < 0.5
    flickering = [shoot(put_ball(BOARD, place), rng, gain=gain) for place, gain in zip(places, (1.040, 1.044))]
    assert find(static, flickering[1]).pixel_count > 0.9 * BOARD.size
    region = find(FrameDifferenceDetector(), *flickering)
    assert math.dist(region[:2], MIDDLE) < 0.5 and region.pixel_count < 300


def test_normalised_gain_stands_strong_flicker():
    rng = np.random.default_rng(2)
    places = MIDDLE - (3.0, 0.0), MIDDLE + (3.0, 0.0)
    images = [shoot(put_ball(BOARD, place), rng, gain=gain) for place, gain in zip(places, (1.0, 0.94))]
    as_the_paper = FrameDifferenceDetector(FrameDifference(normalise_gain=False))
    assert find(as_the_paper, *images).pixel_count > 0.9 * BOARD.size
    normalised = FrameDifferenceDetector()
    assert math.dist(find(normalised, *images)[:2], MIDDLE) < 0.5
    # The light was switched off: nothing can be told.
    assert find(normalised, images[0], shoot(0.3 * BOARD, rng)) is None


@pytest.mark.parametrize(
    "make",
    [
        FrameDifferenceDetector,
        lambda window: BackgroundDifferenceDetector(
            BackgroundDifference(threshold=6.0), image=BOARD.astype(np.uint8), window=window
        ),
    ],
)
def test_nothing_outside_the_window_shows(make):
    rng = np.random.default_rng(4)
    window = np.zeros(BOARD.shape, np.uint8)
    window[:, :90] = 1
    detector = make(window=window)
    moving = [put_ball(put_ball(BOARD, (50.0 + k, 60.0)), (120.0, 60.0 + 5 * k)) for k in (0, 4)]
    images = [shoot(image, rng) for image in moving][-detector.buffer_length :]
    region = find(detector, *images)
    assert abs(region.u - 52.0) < 3.0 and abs(region.v - 60.0) < 1.0
    with pytest.raises(DrakeTrackerError, match="window of interest is empty"):
        make(window=np.zeros(BOARD.shape, np.uint8))


def test_images_for_figures():
    rng = np.random.default_rng(5)
    detector = FrameDifferenceDetector()
    pair = [detector.smooth(shoot(put_ball(BOARD, MIDDLE + (x, 0.0)), rng)) for x in (-3.0, 3.0)]
    images = detector.images(*pair)
    assert isinstance(images, DifferenceImages)
    assert (images.reference == pair[0]).all() and (images.smoothed == pair[1]).all()
    assert (images.motion_energy == detector.mask(*pair)).all() and images.motion_energy.any()
    assert (images.difference == np.abs(pair[1].astype(int) - pair[0])).all()
    static = BackgroundDifferenceDetector(BackgroundDifference(threshold=6.0), image=shoot(BOARD, rng)).images(pair[1])
    assert static.motion_energy.any() and static.difference.max() > 5
    assert StaticThresholdDetector().images(pair[1]).motion_energy.any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"stride": 0}, "stride is 0; it must be a whole number from 1 to 4 cycles"),
        ({"stride": 1.5}, "stride is 1.5; it must be a whole number"),
        ({"threshold": math.nan}, "threshold is nan"),
        ({"smoothing_size": 4}, "smoothing_size is 4 px; it must be odd"),
        ({"centroid": "middle"}, "centroid is 'middle'; it must be one of mean, hull"),
        ({"min_pixels": 0}, "min_pixels is 0"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(DrakeTrackerError, match=message):
        FrameDifferenceDetector(FrameDifference(**settings))


def test_a_static_image_must_fit():
    with pytest.raises(DrakeTrackerError, match="must have 8 bits"):
        BackgroundDifferenceDetector(image=BOARD)
    detector = BackgroundDifferenceDetector(BackgroundDifference(threshold=3.0), image=BOARD.astype(np.uint8))
    with pytest.raises(DrakeTrackerError, match="take a new one"):
        detector.mask(np.zeros((40, 50), np.uint8))
