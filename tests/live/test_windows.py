"""Windows around the board's circles, as a person marks them."""

import threading

import cv2
import numpy as np
import pytest

from drake_tracker.live.windows import WindowQuestion

PLACES = [(20, 20), (80, 22), (22, 80), (78, 78)]


def board():
    image = np.full((100, 100, 3), 200, np.uint8)
    for place in PLACES:
        cv2.circle(image, place, 5, (10, 10, 10), -1)
    return image


@pytest.fixture
def question():
    return WindowQuestion([board()] * 2, 110.0, 4)


def around(u, v, half=9):
    return [u - half, v - half, 2 * half, 2 * half]


def test_a_window_is_read(question):
    reading, window = question.read([11.6, 11.2, 18, 18])
    assert (reading.u, reading.v) == pytest.approx((20.0, 20.0), abs=0.1) and window == [11, 11, 18, 18]


@pytest.mark.parametrize(
    "window, said",
    [
        ([40, 40, 10, 10], "contains no whole circle"),
        ([5, 5, 90, 90], "contains 4 dark areas"),
        ([95, 95, 10, 10], "is not inside the image"),
        ([0, 0, 10], "four numbers"),
        ([0, 0, 10, float("nan")], "four numbers"),
        ([0, 0, 10, 1e30], "four numbers"),
        ("1234", "four numbers"),
        (None, "four numbers"),
        ([[], 0, 0, 0], "four numbers"),
    ],
)
def test_a_window_that_will_not_do_is_said_to_be(question, window, said):
    with pytest.raises(ValueError, match=said):
        question.read(window)


def test_the_answer_is_waited_for(question):
    windows = [around(*place) for place in PLACES]
    threading.Timer(0.2, question.answer, [windows]).start()
    waited = []
    assert question.wait(lambda: waited.append(True)) == [[float(value) for value in window] for window in windows]
    assert waited


def test_none_means_that_they_are_found(question):
    question.answer([])
    assert question.wait() == []


def test_answers_that_will_not_do(question):
    four = [around(*place) for place in PLACES]
    twice = four[:3] + four[:1]
    for windows, said in ((four[:3], "4 windows are needed"), (twice, "1 and 4 hold the same"), (7, "are needed")):
        with pytest.raises(ValueError, match=said):
            question.answer(windows)
    assert cv2.imdecode(np.frombuffer(question.png, np.uint8), 1).shape == (100, 100, 3)
