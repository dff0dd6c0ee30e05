"""Objects that change their look or come closer are seen in front of the scene that they cover."""

import cv2
import numpy as np
import pytest

from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.image_tracks.empty_scene import remember_empty, shows_more
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker
from drake_tracker.vision.image_tracks.track_2d import TrackState2D, start_track

PERIOD = 1.0 / 30.0
SHIFT = 4
"""Binary digits of a fraction of a pixel in what OpenCV draws."""


def scene(seed):
    rng = np.random.default_rng(seed)
    return 110.0 + 15.0 * cv2.resize(rng.normal(size=(30, 40)), (320, 240))


def disc(image, u, v, radius, grey):
    place = tuple(round(value * 2**SHIFT) for value in (u, v))
    cv2.circle(image, place, round(radius * 2**SHIFT), grey, -1, cv2.LINE_AA, SHIFT)


def box(image, left, top, right, bottom, grey):
    low, high = (tuple(round(value * 2**SHIFT) for value in corner) for corner in ((left, top), (right, bottom)))
    cv2.rectangle(image, low, high, grey, -1, cv2.LINE_AA, SHIFT)


def person(image, k):
    """Walks, and sits down from image 50 on: it becomes shorter and wider."""
    sat = np.clip((k - 50) / 20, 0.0, 1.0)
    u, height, half = 50.0 + 1.5 * min(k, 50), 100.0 * (1.0 - 0.4 * sat), 15.0 + 6.0 * sat
    box(image, u - half, 210.0 - height, u + half, 210.0, 40)
    disc(image, u, 222.0 - height, 11.0, 190)
    box(image, u - half + 4.0, 238.0 - height, u + half - 4.0, 248.0 - height, 90)
    return u, 210.0 - 0.5 * height


def wheel(image, k):
    """Rolls, and turns in place from image 45 on."""
    u, angle = 50.0 + 2.0 * min(k, 45), 0.1 * k
    disc(image, u, 120.0, 25.0, 215)
    disc(image, u + 14.0 * np.cos(angle), 120.0 + 14.0 * np.sin(angle), 8.0, 40)
    return u, 120.0


def lamp(image, k):
    """Moves, and becomes dark where it stands from image 55 on."""
    u = 50.0 + 2.0 * min(k, 45)
    disc(image, u, 120.0, 20.0, 230.0 - 190.0 * np.clip((k - 55) / 12, 0.0, 1.0))
    return u, 120.0


def tracked(draw, count, seed, stride=2):
    """Returns (state, number, error [px] or infinity) of each image, from the tenth on."""
    detector, tracker = NormalFlowDetector(NormalFlow(stride=stride), period=PERIOD), ImageTracker(period=PERIOD)
    rng, background, places, smoothed, found = np.random.default_rng(seed), scene(seed), [], [], []
    objects = tracker.start()
    for k in range(count):
        image = background.copy()
        places.append(draw(image, k))
        image += rng.normal(0.0, 1.5, image.shape)
        smoothed.append(detector.smooth(np.clip(image, 0, 255).astype(np.uint8)))
        middle = k - stride
        if middle >= stride:
            used = smoothed[middle - stride :: stride]
            objects, _, centroid = tracker.update(objects, middle * PERIOD, detector, used)
            track = objects.target()
            if middle >= 10:
                off = np.inf if centroid is None else np.hypot(*(np.array(centroid[:2]) - places[middle]))
                found.append((track.state if track else TrackState2D.LOST, objects.targets[0], off))
    return [list(column) for column in zip(*found)]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("draw", [person, wheel, lamp])
def test_a_slow_object_that_changes_its_look_is_seen(draw, seed):
    """It was hidden for a second, and then lost."""
    states, numbers, off = tracked(draw, 110, seed)
    gone = [state in (TrackState2D.HIDDEN, TrackState2D.LOST) for state in states]
    assert sum(gone) <= 3 and set(numbers) == {1}  # a lamp as bright as the scene is invisible
    assert np.median(off) < 3.0 and np.mean(np.array(off) < 10.0) > 0.95 and off[-1] < 5.0


@pytest.mark.parametrize(("rate", "speed", "stride"), [(1.015, 0.5, 3), (1.02, 0.6, 2), (1.025, 0.9, 1)])
def test_an_object_that_comes_closer_is_measured_as_a_whole(rate, speed, stride):
    """Its rear rim stood in the image while its front rim moved: it was measured up to 20 px beside its centre."""

    def draw(image, k):
        u, v = 110.0 + speed * k, 110.0 + 0.2 * k
        disc(image, u, v, 12.0 * rate**k, 225)
        return u, v

    states, numbers, off = tracked(draw, 90, 3, stride)
    assert set(states) == {TrackState2D.MOVING} and set(numbers) == {1}
    assert np.median(off) < 3.0 and max(off[-30:]) < 5.0


def test_an_object_that_leaves_is_no_silhouette():
    """What it covered is known once it has left; the scene where it was first stays unknown until then."""
    empty, region = np.clip(scene(4), 0, 255).astype(np.uint8), ImageRegion(100.0, 120.0, 90, 80, 100, 41, 41)
    image = empty.copy()
    cv2.circle(image, (100, 120), 20, 230, -1)
    track = start_track(1, 0.0, region, image)
    first = remember_empty(None, image, [track])
    assert first.unknown[120, 100] == 255 and first.unknown[102, 82] == 1 and first.unknown[120, 200] == 0
    assert first.silhouette(track, image) is None
    known = remember_empty(first, empty, [])
    whole = known.silhouette(track, image)
    assert (whole.u, whole.v) == pytest.approx((100.0, 120.0), abs=0.5)
    assert (whole.left, whole.top, whole.width, whole.height) == pytest.approx((80, 100, 41, 41), abs=3)
    assert known.silhouette(track, empty) is None


def test_a_silhouette_shows_more_than_a_part_and_not_more_than_all():
    whole = ImageRegion(50.0, 50.0, 90, 30, 30, 40, 40)
    assert shows_more(whole, whole._replace(left=45, width=25))
    assert not shows_more(whole, whole._replace(left=28, width=44))
    assert not shows_more(whole, whole._replace(left=20, width=30))
