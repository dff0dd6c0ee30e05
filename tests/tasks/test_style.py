"""Tests of colours and text."""

import re
import sys
import threading
from enum import IntEnum

import numpy as np

from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks import style
from drake_tracker.tasks.style import PHASE_COLOURS, bgr, draw_text, phase_colour


def test_the_phases_of_a_task_have_different_colours():
    assert set(PHASE_COLOURS) == {phase.name for phases in (Phase, CatchPhase) for phase in phases}
    for phases in (Phase, CatchPhase):
        assert len({phase_colour(phase) for phase in phases}) == len(phases)


def test_a_phase_that_is_not_listed_has_a_colour():
    class Other(IntEnum):
        WELD = 3

    assert re.fullmatch("#[0-9a-f]{6}", phase_colour(Other.WELD))


def test_bgr():
    assert bgr("#ff8001") == (1, 128, 255)


def test_text_stands_on_its_baseline():
    image = np.zeros((60, 200, 3), np.uint8)
    end = draw_text(image, "HH", 20, 40, 20, "#ffffff")
    rows, columns = np.nonzero(image[:, :, 0] > 128)
    assert rows.max() == 39 and 24 <= rows.min() <= 26
    assert 20 <= columns.min() <= 24 and columns.max() < end
    assert image.max() == 255


def test_a_descender_hangs_below_the_baseline():
    image = np.zeros((60, 100, 3), np.uint8)
    draw_text(image, "g", 20, 40, 20)
    assert np.nonzero(image[:, :, 0] > 128)[0].max() > 40


def test_text_beyond_the_edges_is_clipped():
    image = np.zeros((20, 30, 3), np.uint8)
    for x, y in ((-10, 15), (25, 15), (5, 2), (5, 30), (100, 100)):
        draw_text(image, "drake", x, y, 16)
    assert image.shape == (20, 30, 3)


def test_text_is_blended_with_the_image():
    image = np.full((40, 40, 3), 100, np.uint8)
    draw_text(image, "I", 15, 30, 24, "#00ff00", bold=True)
    assert image[:, :, 1].max() == 255 and image[:, :, 0].min() == 0
    assert (image[0] == 100).all()


def test_threads_write_text_at_the_same_time():
    """The video and the live page draw in threads of their own, with the same fonts."""
    texts = [f"{k} {'text' * (k % 7)}" for k in range(200)]
    drawn = {}

    def draw(part):
        for text in part:
            image = np.zeros((40, 400, 3), np.uint8)
            draw_text(image, text, 5, 25, 17)
            drawn[text] = image

    style._typeset.cache_clear()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=draw, args=(texts[k::2],)) for k in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    found = dict(drawn)
    style._typeset.cache_clear()
    draw(texts)
    assert len(found) == len(texts)
    for text in texts:
        np.testing.assert_array_equal(found[text], drawn[text])


def test_a_line_of_numbers_is_the_same_when_its_characters_are_typeset_one_by_one():
    for text in ("12.34 s", "u 123.4  v 88.2 px", "7"):
        whole, composed = np.zeros((2, 40, 240, 3), np.uint8)
        end = draw_text(whole, text, 10, 24, 15, bold=True)
        assert draw_text(composed, text, 10, 24, 15, bold=True, numbers=True) == end
        assert whole.any() and (whole == composed).all()
