"""Tests of the pictures of a run of the ball."""

import cv2
import matplotlib
import numpy as np
import pytest
from ball_log import BallRun, nothing_logged

from drake_tracker.tasks.ball.board_figure import draw_board_found, draw_difference_images
from drake_tracker.tasks.ball.path_figure import draw_ball_path
from drake_tracker.tasks.ball.setup import resolve
from drake_tracker.tasks.ball.summary import summarise_ball
from drake_tracker.vision.centroid.frame_difference import DifferenceImages

TITLES = ("Image n", "Image n + 1/30 s", "Thresholded difference")


@pytest.fixture
def run():
    return BallRun()


def draw(run, path, log=None):
    log = run.log() if log is None else log
    summary = summarise_ball(run.hand_eye, resolve(run.scenario, run.hand_eye.poses), log, run.duration)
    draw_ball_path(run.hand_eye, resolve(run.scenario, run.hand_eye.poses), log, summary, path)
    return cv2.imread(str(path))


def near(image, colour):
    """Returns the number of pixels close to a BGR colour."""
    return np.count_nonzero((np.abs(image.astype(int) - colour) < 12).all(axis=2))


def test_a_catch_is_drawn_without_changing_global_state(run, tmp_path):
    before = dict(matplotlib.rcParams)
    image = draw(run, tmp_path / "ball_path.png")
    assert image.shape == (1800, 3200, 3)
    assert near(image, (115, 158, 0)) > 3000, "the path of the cup"
    assert near(image, (233, 180, 86)) > 1000, "the filtered path and the phase FOLLOW"
    assert dict(matplotlib.rcParams) == before


def test_a_ball_that_is_never_released(run, tmp_path):
    run.released = None
    assert draw(run, tmp_path / "ball_path.png").shape == (1800, 3200, 3)


def test_a_miss(run, tmp_path):
    run.hand, run.caught = 0.2, False
    assert draw(run, tmp_path / "ball_path.png").shape == (1800, 3200, 3)


def test_a_run_that_logged_nothing(run, tmp_path):
    assert draw(run, tmp_path / "ball_path.png", nothing_logged()).shape == (1800, 3200, 3)


def test_the_board_that_was_found(run, tmp_path):
    summary = summarise_ball(run.hand_eye, resolve(run.scenario, run.hand_eye.poses), run.log(), run.duration)
    draw_board_found(resolve(run.scenario, run.hand_eye.poses), summary, tmp_path / "board.png")
    image = cv2.imread(str(tmp_path / "board.png"))
    assert image.shape == (1230, 2100, 3)
    assert near(image, (178, 114, 0)) > 1000 and near(image, (0, 94, 213)) > 500, "outline and circles"


@pytest.mark.parametrize("moves", [True, False])
def test_figure_4_of_the_paper(moves, tmp_path):
    grey = np.tile(np.arange(60, dtype=np.uint8), (50, 1))
    mask = np.zeros_like(grey)
    mask[20:24, 30:36] = 255 * moves
    draw_difference_images(DifferenceImages(grey, grey, mask, mask), TITLES, tmp_path / "motion.png")
    image = cv2.imread(str(tmp_path / "motion.png"))
    assert abs(image.shape[1] - 3000) < 40 and image.shape[0] > 800
    rows = np.flatnonzero((image < 250).any(axis=(1, 2)))
    assert rows[0] < 40 and image.shape[0] - rows[-1] < 40, "no empty margin"
    assert (near(image, (0, 159, 230)) > 500) == moves, "the frame of the enlarged part"
