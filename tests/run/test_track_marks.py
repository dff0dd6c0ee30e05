"""Tests of the marks of regions and tracks in a frame of the camera video."""

import numpy as np
import pytest
from track_messages import regions, track, track_points

from drake_tracker.core.messages import TrackState
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.track_marks import dashed_ring, draw_track, region_marks, tag, track_marks
from drake_tracker.run.video_page import CameraSight, PageState, VideoPage
from drake_tracker.tasks.style import bgr, track_light
from drake_tracker.tasks.tracks import track_rows

WINDOW = np.array([[10.0, 80.0], [245.0, 80.0], [245.0, 190.0], [10.0, 190.0]])
STATE = PageState(1.0, Phase.TRACK, ("", ""), 0.75)


class Camera:
    """A camera whose pixel coordinates are x and y in millimetres."""

    def project(self, p_WQ):
        return 1e3 * np.asarray(p_WQ)[:, :2]


def marks(*tracks, target=1, now=1.0, stamp=0.75):
    return track_marks(track_points(stamp, tracks, target), Camera(), now)


def pixels_of(image, colour):
    """Columns and rows of the pixels with a colour."""
    rows, columns = np.nonzero((np.abs(image.astype(int) - bgr(colour)) < 25).all(axis=2))
    return columns, rows


def test_the_marks_lie_where_the_object_was_and_where_it_is_now():
    moving, standing = marks(track(1, 0.1, 0.12, vx=0.08, vy=-0.04), track(2, 0.2, 0.1, state=TrackState.STANDING))
    assert moving.then == pytest.approx((100.0, 120.0)) and moving.now == pytest.approx((120.0, 110.0))
    assert standing.then == standing.now == pytest.approx((200.0, 100.0))
    (noisy,) = marks(track(1, 0.1, 0.1, vx=0.01, state=TrackState.STANDING))
    assert noisy.then == noisy.now, "an object that stands does not drift"
    assert marks() == ()


def test_the_marks_of_regions():
    found = region_marks(regions(0.75, (100, 110, 20, 10, 2), (50, 60, 5, 6, 0), (70, 60, 5, 6, -1)))
    assert [(mark.u, mark.width, mark.number) for mark in found] == [(100, 20, 2), (50, 5, 0), (70, 5, -1)]
    assert region_marks(np.zeros_like(regions(0.0))) == ()


def page(several=True):
    return VideoPage({"left": WINDOW, "right": WINDOW}, (256, 256), "train", "seed 0", 0.25, several=several)


def sight(**changes):
    black = np.zeros((120, 240, 3), np.uint8)
    nothing = dict(image=black, offset=(8, 76), path=np.zeros((0, 2)), late_image=black, energy=None, centroid=None)
    return CameraSight(**{**nothing, **changes})


def panels(video, frame):
    return {(side, late): frame[y : y + h, x : x + w] for side, late, (x, y, w, h) in video.panels}


def test_each_object_is_drawn_at_its_place_in_its_colour():
    video = page()
    seen = sight(
        tracks=marks(track(1, 0.1, 0.12, vx=0.2), track(2, 0.2, 0.15), target=2),
        regions=region_marks(regions(0.75, (100, 120, 30, 20, 1), (200, 150, 40, 10, 2), (40, 100, 10, 8, 0))),
    )
    shown = panels(video, video.draw({"left": seen, "right": sight()}, STATE))
    places = video.places({"left": seen, "right": sight()})
    for number in (1, 2):
        for (side, late), (x, y) in zip(((side, late) for side, late, _ in video.panels), places[number]):
            columns, rows = pixels_of(shown[side, late], track_light(number))
            assert np.hypot(columns - x, rows - y).min() < 2.0, (number, side, late)
    width = np.ptp(pixels_of(shown["left", True], track_light(2))[0])
    assert width == pytest.approx(40 * video._scale, abs=4), "the rectangle has the extents of the region"
    assert not len(pixels_of(shown["right", True], track_light(2))[0]), "the other camera shows nothing"


def test_the_target_is_emphasised_and_an_object_that_is_not_seen_is_hollow():
    def drawn(*tracks, target):
        image = np.zeros((60, 60, 3), np.uint8)
        (row,) = track_rows(track_points(0.0, tracks, target))
        draw_track(image, (25.0, 35.0), row)
        return image

    colour = track_light(3)
    plain, target = (len(pixels_of(drawn(track(3), target=n), colour)[0]) for n in (0, 3))
    assert target > plain + 40
    assert pixels_of(drawn(track(3), target=0)[34:37, 24:27], colour)[0].size == 9, "a dot"
    lost = drawn(track(3, state=TrackState.OCCLUDED), target=0)
    assert not lost[33:38, 23:28].any(), "a ring"
    columns, rows = pixels_of(lost[25:46, 15:36], colour)
    gaps = np.diff(np.sort(np.arctan2(rows - 10, columns - 10)))
    assert np.count_nonzero(gaps > 0.2) >= 6, "dashed"


@pytest.mark.parametrize("place", [(np.nan, 1.0), (1e7, 5.0), (-1e7, np.inf), (-40.0, 10.0), (59.0, 59.0)])
def test_a_mark_outside_the_image_is_allowed(place):
    image = np.zeros((60, 60, 3), np.uint8)
    for state in (TrackState.MOVING, TrackState.OUT_OF_VIEW):
        (row,) = track_rows(track_points(0.0, [track(12, state=state)], 12))
        draw_track(image, place, row)
    dashed_ring(image, (59.0, 0.0), 10.0, "#ffffff")
    tag(image, 58, 3, "123", "#ffffff", True)


def test_the_reason_is_written_above_the_present_images():
    video = page()
    sights = {"left": sight(), "right": sight()}
    without = video.draw(sights, STATE)
    longest = PageState(1.0, Phase.TRACK, ("", ""), 0.75, reason="an image cannot be compared with the background")
    changed = np.nonzero((video.draw(sights, longest) != without).any(axis=2))
    assert changed[0].size and changed[0].max() < 50 and changed[1].min() > 300 and changed[1].max() < 1060


def test_a_page_of_one_object_is_as_before():
    """The words and legend of several objects are on no other page."""
    sights = {"left": sight(), "right": sight()}
    default = VideoPage({"left": WINDOW, "right": WINDOW}, (256, 256), "train", "seed 0", 0.25)
    np.testing.assert_array_equal(default.draw(sights, STATE), page(False).draw(sights, STATE))
    assert (page().draw(sights, STATE) != default.draw(sights, STATE)).any()
