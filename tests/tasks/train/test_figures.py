"""Tests of the pictures."""

import cv2
import matplotlib
import numpy as np
import pytest
from track_messages import track, track_points, tracks_signal

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.plots import draw_motion_images
from drake_tracker.tasks.style import bgr, track_colour
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.figures import _lap, draw_tracking
from drake_tracker.tasks.train.summary import summarise
from drake_tracker.vision.normal_flow import MotionImages
from drake_tracker.vision.object_track import TrackState


def draw(scenario, log, path):
    draw_tracking(scenario, log, summarise(scenario, log, 6.0), path)
    return cv2.imread(str(path))


def test_a_success_is_drawn_without_changing_global_state(scenario, episode, grasp_phases, tmp_path):
    before = dict(matplotlib.rcParams)
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.004 * np.sin(3 * t)
    episode.verdict["taken"] = lambda t: (t > 5.5).astype(float)
    image = draw(scenario, episode.log(), tmp_path / "tracking.png")
    assert image.shape == (1800, 3200, 3)
    assert (image < 250).any(axis=2).mean() > 0.03
    assert dict(matplotlib.rcParams) == before


def test_a_run_that_was_over_at_once(scenario, episode, tmp_path):
    episode.duration = 0.0
    assert draw(scenario, episode.log(), tmp_path / "tracking.png").shape == (1800, 3200, 3)


def test_a_run_that_logged_nothing(scenario, nothing, tmp_path):
    assert draw(scenario, nothing, tmp_path / "tracking.png").shape == (1800, 3200, 3)


def test_a_run_without_a_valid_point(scenario, episode, tmp_path):
    episode.valid = lambda t: 0.0 * t
    assert draw(scenario, episode.log(), tmp_path / "tracking.png").shape == (1800, 3200, 3)


def test_the_map_shows_one_lap_of_a_closed_track(scenario, episode, grasp_phases):
    scenario = scenario.with_settings({"track.kind": "circle", "track.radius": 0.05})
    episode.phases = grasp_phases
    log = episode.log()
    start, end = _lap(scenario, log, phase_spans(log))
    assert end == pytest.approx(3.54, abs=0.02)
    assert end - start == pytest.approx(2 * np.pi * 0.05 / 0.1, abs=0.03)


def test_motion_images(tmp_path):
    grey = np.tile(np.arange(60.0), (40, 1))
    images = MotionImages(grey, grey - 30.0, grey, grey, grey, np.where(grey > 30, 255, 0).astype(np.uint8))
    draw_motion_images({"left": images, "right": images}, tmp_path / "motion.png")
    image = cv2.imread(str(tmp_path / "motion.png"))
    assert image.shape[1] == 3000 and image.shape[0] > 1000


def test_the_map_shows_the_other_objects_that_were_tracked(scenario, episode, grasp_phases, tmp_path):
    episode.phases = grasp_phases
    log = episode.log()
    before = draw(scenario, log, tmp_path / "before.png")

    def message(k):
        stamp = VISION_PERIOD * (k + 1)
        (x, y), state = episode.place(np.array([stamp]))[0], TrackState.NOT_OBSERVED if k > 200 else TrackState.MOVING
        return track_points(stamp, [track(1, x, y), track(2, x + 0.1, y, state=state)], 1)

    log["tracks"] = tracks_signal(message, 210)
    after = draw(scenario, log, tmp_path / "after.png")
    rows, columns = np.nonzero((before != after).any(axis=2))
    assert len(rows) and columns.max() < 1700, "only the map differs"
    pink = np.abs(after.astype(int) - bgr(track_colour(2))).max(axis=2) < 12
    assert np.count_nonzero(pink & (before != after).any(axis=2)) > 300
