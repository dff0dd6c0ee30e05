"""Large images are reduced, as far as the object stays large enough; results are in pixels of the full one."""

import json

import numpy as np
import pytest
from disc_films import PERIOD, clip, live
from films import write_images

from drake_tracker import cli
from drake_tracker.footage.footage import Footage
from drake_tracker.own_cameras.detector_choice import suited, suited_live
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.pyramid_level import enlarged, reduced, reduced_pixel, reduced_window
from drake_tracker.vision.image_tracks.track_2d import start_track

SIZE = (1200, 300)


def recording(radius, speed=6.0):
    pictures = [np.repeat(picture[..., None], 3, axis=2) for _, picture in clip(radius, speed, 100, SIZE)]
    times = PERIOD * np.arange(len(pictures))
    return Footage("clip", SIZE, lambda: iter(zip(times, pictures)), times=times)


def test_a_pixel_of_the_reduced_image_is_the_mean_of_a_square():
    image = np.arange(35, dtype=np.uint8).reshape(5, 7)
    np.testing.assert_array_equal(reduced(image, 2), [[4, 6, 8], [18, 20, 22]])
    assert reduced(image, 1) is image
    assert reduced_pixel((3.5, 0.5), 2) == (1.5, 0.0) and reduced_pixel(None, 2) is None
    window = np.zeros((5, 7), np.uint8)
    window[:, 3:] = 255
    np.testing.assert_array_equal(reduced_window(window, 2), np.tile([0, 255, 255], (2, 1)))


def test_objects_are_given_in_pixels_of_the_full_image():
    """The rectangle of a square in the full image is that of the reduced square, enlarged."""
    image = np.zeros((40, 60), np.uint8)
    image[8:20, 24:36] = 200
    rows, columns = np.nonzero(reduced(image, 2))
    region = ImageRegion(columns.mean(), rows.mean(), len(rows), columns.min(), rows.min(), 6, 6)
    track = start_track(3, 0.5, region, reduced(image, 2))
    found = enlarged(ImageObjects((track,), (3,), displacement=0.5, lost=(track,)), 2)
    (full,) = found.tracks
    np.testing.assert_allclose(full.mean, [29.5, 13.5, 0.0, 0.0])
    np.testing.assert_allclose(full.place, [29.5, 13.5])
    np.testing.assert_allclose(full.covariance, 4.0 * track.covariance)
    assert full.region == ImageRegion(29.5, 13.5, 144, 24, 8, 12, 12)
    assert (full.width, full.height, full.area, full.pixel_count, full.number) == (12, 12, 144, 144, 3)
    assert found.displacement == 1.0 and found.lost[0].size == 12.0
    assert enlarged(found, 1) is found


@pytest.mark.parametrize(("radius", "settings", "factor"), [(45, {}, 2), (20, {}, 1), (45, {"min_pixels": 40}, 1)])
def test_the_coarsest_level_has_enough_pixels_of_the_object(radius, settings, factor):
    footage = [recording(radius)]
    found = suited(NormalFlow(**settings), footage, PERIOD, [None], [None])
    (look,) = found.looks
    assert found.reduce_by == factor
    assert look.size == pytest.approx(2 * radius, rel=0.15) and look.speed == pytest.approx(6.0, rel=0.05)
    if factor > 1:
        assert found.settings.join_distance == look.join_distance / factor


def test_the_same_holds_for_live_cameras():
    pictures = [picture for _, picture in clip(45, 6.0, 45, SIZE)]
    found, _ = suited_live(NormalFlow(), [live(pictures)], 100 * PERIOD, [None])
    assert found.reduce_by == 2 and found.looks[0].size == pytest.approx(90.0, rel=0.15)


def test_a_large_object_in_large_images_is_tracked_where_it_is(tmp_path):
    places, pictures = zip(*clip(45, 6.0, 60, SIZE))
    source, out = write_images(tmp_path / "shots", pictures), tmp_path / "out"
    choice = ["--follow", f"{places[0]:.0f},150", "--roi", "0,60,1200,180"]
    assert cli.main(["track", source, "--fps", "30", *choice, "--out", str(out)]) == 0
    track = np.genfromtxt(out / "track.csv", delimiter=",", names=True)
    off = np.hypot(track["u"] - np.interp(track["stamp"], np.arange(60) * PERIOD, places), track["v"] - 150.0)
    assert np.nanmedian(off) < 0.5 and np.nanmax(off) < 2.0 and np.isfinite(off).all()
    summary = json.loads((out / "summary.json").read_text())
    assert summary["images_reduced_by"] == 2
