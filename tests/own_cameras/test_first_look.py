"""A first look at a recording sets the stride and the join distance of the detector."""

import json

import cv2
import numpy as np
import pytest
from disc_films import PERIOD, clip, live
from films import write_images

from drake_tracker import cli
from drake_tracker.footage.sources import open_footage
from drake_tracker.own_cameras.detector_choice import can_suit, suited, suited_live
from drake_tracker.own_cameras.first_look import is_whole, median_image, take_a_look
from drake_tracker.vision.centroid.config import FrameDifference, NormalFlow


def look(pictures, settings=NormalFlow(stride=1), window=None, follow=None):
    pictures = list(pictures)
    colour = [np.repeat(picture[..., None], 3, axis=2) for picture in pictures]
    return take_a_look(lambda: ((0.0, image) for image in colour), len(colour), settings, PERIOD, window, follow)


@pytest.mark.parametrize(
    ("radius", "speed", "stride", "joined"),
    [(10, 16.0, 1, False), (15, 3.0, 1, False), (14, 0.45, 3, False), (45, 1.0, 2, True)],
)
def test_size_and_speed_set_stride_and_join_distance(radius, speed, stride, joined):
    found = look(picture for _, picture in clip(radius, speed))
    assert 0.65 * 2 * radius < found.size < 1.2 * 2 * radius
    assert abs(found.stride - stride) <= (0 if speed > 2.0 else 1)
    assert (found.join_distance > 24) == joined
    assert speed < 2.0 or found.speed == pytest.approx(speed, rel=0.05)


def test_a_region_is_whole_with_front_and_rear_edge():
    """Half of a disc counted as whole where it covered the silhouette, of which the background hid the other half."""
    mask = np.zeros((300, 400), np.uint8)
    cv2.ellipse(mask, (200, 150), (90, 90), 0, -50, 50, 255, 3)  # the edges that move
    cv2.ellipse(mask, (200, 150), (90, 90), 0, 130, 230, 255, 3)
    for left, width in ((110, 180), (110, 120)):  # the silhouette, and what is left of it
        box = np.array([left, 60.0, width, 180.0, left + 0.5 * width, 150.0])
        assert not is_whole(mask, box, 24) and is_whole(mask, box, 160)
    assert not is_whole(np.zeros_like(mask), box, 24)


def test_where_nothing_moves_alone_there_is_nothing_to_see():
    rng = np.random.default_rng(2)
    still = cv2.resize(rng.normal(110.0, 30.0, (30, 40)), (400, 300)).clip(0, 255).astype(np.uint8)
    assert look([still] * 60) is None and look([still] * 10) is None
    assert look([np.roll(still, 3 * k, axis=1) for k in range(60)]) is None
    window = np.zeros((300, 400), np.uint8)
    window[:40] = 255
    assert look((picture for _, picture in clip(15, 3.0)), window=window) is None


def test_what_the_user_has_set_stays(tmp_path):
    source = write_images(tmp_path / "shots", [picture for _, picture in clip(45, 1.0)])
    footage = [open_footage(source, 30.0)]
    assert suited(NormalFlow(), footage, PERIOD, [None], [None])[0].join_distance > 24
    kept = suited(NormalFlow(join_distance=30), footage, PERIOD, [None], [None])[0]
    assert kept.join_distance == 30 and kept.stride > 1
    assert suited(FrameDifference(), footage, PERIOD, [None], [None])[0].join_distance >= 12
    assert can_suit(NormalFlow()) and not can_suit(NormalFlow(stride=1, join_distance=5))
    assert not can_suit(NormalFlow(preset="paper_literal")) and not can_suit(FrameDifference(stride=1))


def test_a_slow_object_is_tracked_where_it_is(tmp_path):
    """With the usual stride and join distance, only its front or its rear edge was tracked: 30 px off."""
    places, pictures = zip(*clip(45, 1.0))
    source = write_images(tmp_path / "shots", pictures)
    out = tmp_path / "out"
    assert cli.main(["track", source, "--fps", "30", "--no-overlay", "--out", str(out)]) == 0
    track = np.genfromtxt(out / "track.csv", delimiter=",", names=True)
    off = np.abs(track["u"] - np.interp(track["stamp"], np.arange(len(places)) * PERIOD, places))
    assert np.nanmedian(off) < 0.5 and len(track) > 100
    summary = json.loads((out / "summary.json").read_text())
    assert summary["first_look"][0]["join_distance"] == summary["detector"]["join_distance"] > 24


def ball_beside_a_disc(count=110):
    """A large disc that is slow, and below it a ball of 16 px that makes 14 px an image."""
    for k, (_, picture) in enumerate(clip(50, 0.5, count)):
        u = 30.0 + abs((14.0 * k + 340.0) % 680.0 - 340.0)
        rows, columns = np.mgrid[:300, :400]
        share = np.clip(8.5 - np.hypot(columns - u, rows - 260.0), 0.0, 1.0)
        yield u, (picture + share * (20.0 - picture)).astype(np.uint8)


def test_the_object_to_follow_sets_stride_and_join_distance(tmp_path):
    """The largest object set them: the ball was as far apart in the compared images as it must not be."""
    places, pictures = zip(*ball_beside_a_disc())
    assert look(pictures).stride > 1
    for pixel in ((places[0], 260.0), (places[0] - 10.0, 265.0)):
        found = look(pictures, follow=pixel)
        assert found.stride == 1 and found.join_distance <= 24
        assert 12.0 < found.size < 20.0 and found.speed == pytest.approx(14.0, rel=0.05)
    assert look(pictures, follow=(20.0, 20.0)) == look(pictures)  # nothing moves there
    source, out = write_images(tmp_path / "shots", pictures), tmp_path / "out"
    follow = ["--follow", f"{places[0]:.0f},260"]
    assert cli.main(["track", source, "--fps", "30", "--no-overlay", "--out", str(out), *follow]) == 0
    track = np.genfromtxt(out / "track.csv", delimiter=",", names=True)
    seen = track["valid"] > 0
    off = np.abs(track["u"] - np.interp(track["stamp"], np.arange(len(places)) * PERIOD, places))[seen]
    assert np.median(off) < 1.0 and np.mean(off > 8.0) < 0.05 and seen.mean() > 0.9


def test_a_live_camera_is_looked_at_before_the_track(tmp_path, capsys):
    pictures = [picture for _, picture in clip(45, 1.0, 140)]
    found, footage = suited_live(NormalFlow(), [live(pictures), live(pictures)], 100 * PERIOD, [None, None])
    settings, _, looks = found
    assert settings.stride == 2 and settings.join_distance > 24 and looks[0] == looks[1]
    for each in footage:
        assert each.live and each.epoch == pytest.approx(100.0 + 100 * PERIOD)
        times = [time for time, _ in each.frames()]
        np.testing.assert_allclose(times, PERIOD * np.arange(1, 40), atol=1e-9)
    still = [pictures[0]] * 60
    found, _ = suited_live(NormalFlow(), [live(still)], 1.0, [None])
    assert found.looks == [None] and found.settings == suited(NormalFlow(), [live(still)], PERIOD, [None], [None])[0]
    source = write_images(tmp_path / "shots", pictures[:10])
    assert cli.main(["track", source, "--fps", "30", "--first-look", "3", "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert "--first-look 3" in printed.err and "always looked at" in printed.err and not printed.out


@pytest.mark.parametrize("count", [1, 2, 5, 12])
def test_the_median_image_is_that_of_numpy(count):
    images = np.random.default_rng(2).integers(0, 256, (count, 9, 11), dtype=np.uint8)
    assert (median_image(images) == np.median(images, axis=0).astype(np.uint8)).all()
