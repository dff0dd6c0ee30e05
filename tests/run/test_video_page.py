"""Tests of a frame of the camera video."""

import numpy as np
import pytest

from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.video_marks import ENERGY, GOAL
from drake_tracker.run.video_page import _COLUMNS, CameraSight, PageState, VideoPage, _status
from drake_tracker.tasks.style import bgr

WINDOW = np.array([[10.0, 80.0], [245.0, 80.0], [245.0, 190.0], [10.0, 190.0]])
STATE = PageState(12.5, Phase.TRACK, ("attempt 1", "gate: settling"), 12.25)


@pytest.fixture(scope="module")
def page():
    return VideoPage({"left": WINDOW, "right": WINDOW}, (256, 256), "train", "seed 0", 0.25)


def sight(**changes):
    nothing = dict(image=np.zeros((120, 240, 3), np.uint8), offset=(8, 76), path=np.zeros((0, 2)))
    return CameraSight(**{**nothing, "late_image": None, "energy": None, "centroid": None, **changes})


def panels(page, frame):
    """{(side, "now" or "late"): panel}."""
    width, height = page._panel
    return {
        (side, row): frame[y : y + height, x : x + width]
        for side, x in zip(("left", "right"), _COLUMNS)
        for row, y in zip(("now", "late"), page._rows)
    }


def bright_centre(panel, colour):
    rows, columns = np.nonzero((np.abs(panel.astype(int) - colour) < 30).all(axis=2))
    return columns.mean(), rows.mean()


def test_the_size_of_a_frame_is_even(page):
    frame = page.draw({"left": sight(), "right": sight()}, STATE)
    assert frame.shape == (page.size[1], page.size[0], 3) and frame.dtype == np.uint8
    assert page.size[0] % 2 == page.size[1] % 2 == 0


@pytest.mark.parametrize(
    "window, size",
    [
        ([[0.0, 0.0], [255.0, 255.0]], (256, 256)),
        ([[-40.0, -40.0], [400.0, 300.0]], (256, 256)),
        ([[100.0, 100.0], [130.0, 110.0]], (256, 256)),
        ([[10.0, 5.0], [30.0, 60.0]], (64, 64)),
    ],
)
def test_every_window_fits(window, size):
    page = VideoPage({"left": np.array(window), "right": np.array(window)}, size, "t", "s", 0.25)
    image = np.zeros((size[1], size[0], 3), np.uint8)
    whole = sight(image=image, offset=(0, 0), late_image=image, energy=image[:, :, 0], path=np.array([[5.0, 5.0]]))
    frame = page.draw({"left": whole, "right": whole}, STATE)
    assert frame.shape[1] == 1280 and frame.shape[0] <= 760


def test_an_image_is_drawn_at_its_place(page):
    """A bright block at pixels 100-110, 120-130 of the full image is drawn where the page draws pixel (105, 125)."""
    image = np.zeros((120, 240, 3), np.uint8)
    image[120 - 76 : 131 - 76, 100 - 8 : 111 - 8] = 255
    frame = page.draw({"left": sight(image=image), "right": sight()}, STATE)
    expected = page._to_panel(np.array([[105.0, 125.0]]))[0]
    assert bright_centre(panels(page, frame)["left", "now"], (255, 255, 255)) == pytest.approx(expected, abs=0.6)


def test_the_late_image_shows_the_mask_and_its_centroid(page):
    energy = np.zeros((120, 240), np.uint8)
    energy[120 - 76 : 131 - 76, 100 - 8 : 111 - 8] = 255
    late = sight(late_image=np.zeros((120, 240, 3), np.uint8), energy=energy, centroid=None)
    shown = panels(page, page.draw({"left": late, "right": sight()}, STATE))
    expected = page._to_panel(np.array([[105.0, 125.0]]))[0]
    assert bright_centre(shown["left", "late"], bgr(ENERGY)) == pytest.approx(expected, abs=0.6)
    assert not (np.abs(shown["right", "late"].astype(int) - bgr(ENERGY)) < 30).all(axis=2).any()


def test_a_centroid_is_drawn_at_its_place_and_only_if_valid(page):
    black = np.zeros((120, 240, 3), np.uint8)
    seen = sight(late_image=black, centroid=(150.3, 140.7))
    with_cross = panels(page, page.draw({"left": seen, "right": sight()}, STATE))
    expected = page._to_panel(np.array([[150.3, 140.7]]))[0]
    assert bright_centre(with_cross["left", "late"], (246, 244, 242)) == pytest.approx(expected, abs=0.6)
    without = panels(page, page.draw({"left": sight(late_image=black), "right": sight()}, STATE))
    assert without["left", "late"].max() < 60


def test_a_path_outside_the_image_or_behind_the_camera_is_allowed(page):
    path = np.array([[np.nan, np.nan], [1e6, -1e6], [120.0, 130.0]])
    page.draw({"left": sight(path=path), "right": sight(path=path[:1])}, STATE)


def test_a_frame_does_not_depend_on_earlier_frames(page):
    sights = {"left": sight(), "right": sight()}
    first = page.draw(sights, STATE)
    page.draw(sights, PageState(99.0, Phase.HOLD, ("attempt 3", ""), None))
    np.testing.assert_array_equal(page.draw(sights, STATE), first)


@pytest.fixture(scope="module")
def single():
    return VideoPage({"": WINDOW}, (256, 256), "ball", "seed 0", 0.083, goal="predicted crossing")


def test_a_single_camera_is_shown_next_to_its_late_image(single):
    """A block at pixels 100-110, 120-130 is drawn twice at the same height, larger than for two cameras."""
    image = np.zeros((256, 256, 3), np.uint8)
    image[120:131, 100:111] = 255
    seen = sight(image=image, offset=(0, 0), late_image=0 * image, energy=image[:, :, 0])
    frame = single.draw({"": seen}, PageState(1.0, CatchPhase.FOLLOW, ("comes in 0.50 s", ""), 0.9))
    assert frame.shape[0] % 2 == 0 and frame.shape[1] == 1280
    width, height = single._panel
    now, late = (frame[y : y + height, x : x + width] for x, y in single._places[""])
    expected = single._to_panel(np.array([[105.0, 125.0]]))[0]
    assert bright_centre(now, (255, 255, 255)) == pytest.approx(expected, abs=0.6)
    assert bright_centre(late, bgr(ENERGY)) == pytest.approx(expected, abs=0.6)


def test_the_goal_is_marked_at_its_place(single, page):
    state = PageState(1.0, CatchPhase.SETTLE, ("", ""), None)
    goal = np.array([[120.0, 180.0], [110.0, 180.0], [130.0, 180.0]])
    x, y = single._places[""][0]
    marked = single.draw({"": sight(goal=goal)}, state)[y:, x : x + single._panel[0]]
    assert bright_centre(marked, bgr(GOAL)) == pytest.approx(single._to_panel(goal)[0], abs=1.0)
    for out in (np.full((3, 2), np.nan), np.array([[9e5, 0.0], [np.nan, np.nan], [np.nan, np.nan]])):
        single.draw({"": sight(goal=out)}, state)


def test_phases_of_two_tasks_are_distinguished(single):
    """They are equal numbers, and the part of the sidebar with the phases is cached."""
    state = {kind: PageState(1.0, kind(1), ("", ""), None) for kind in (Phase, CatchPhase)}
    frames = [single.draw({"": sight()}, state[kind]) for kind in (Phase, CatchPhase)]
    assert (frames[0] != frames[1]).any()


@pytest.mark.parametrize("phases", [Phase, CatchPhase])
def test_the_notes_below_the_phases_are_not_cut_off(phases):
    """They were when the phases of the operator were added."""
    phase = next(iter(phases))
    without, first, both = (_status(phase, notes) for notes in (("", ""), ("gate: g", ""), ("gate: g", "attempt: g")))
    rows = [np.nonzero((a != b).any(axis=(1, 2)))[0] for a, b in ((without, first), (first, both))]
    assert [len(each) > 8 for each in rows] == [True, True]
    assert rows[0].max() < rows[1].min() and rows[1].max() < len(without) - 1
    below_phases = without[rows[0].min() :]
    assert (below_phases == below_phases[-1, -1]).all()
