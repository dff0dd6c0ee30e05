"""Tests of the pictures."""

import cv2
import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from track_messages import track, track_points, tracks_signal

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import TrackState
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.plots import draw_motion_images
from drake_tracker.tasks.style import bgr, track_colour
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.pictures.figures import _draw_over_time, _lap, draw_tracking
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import summarise
from drake_tracker.vision.centroid.normal_flow import MotionImages


def draw(scenario, log, path):
    draw_tracking(resolve(scenario), log, summarise(resolve(scenario), log, 6.0), path)
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
    start, end = _lap(resolve(scenario), log, phase_spans(log))
    assert end == pytest.approx(3.54, abs=0.02)
    assert end - start == pytest.approx(2 * np.pi * 0.05 / 0.1, abs=0.03)


def right_half(scenario, log, spans):
    """The plots on the right of the picture, from top to bottom."""
    figure = Figure(figsize=(16, 9))
    FigureCanvasAgg(figure)
    _draw_over_time(figure, resolve(scenario), log, spans)
    return figure.axes


def with_probability(log, values):
    signal = log["diagnosis"]
    rows = signal.data.copy()
    rows[:, signal.names.index("p_success")] = values(signal.times)
    return {**log, "diagnosis": Signal(signal.times, rows, signal.names)}


@pytest.mark.parametrize("gate, threshold", [("probability", [80.0, 80.0]), ("auto", None)])
def test_the_probability_of_success_is_below_the_phases(scenario, episode, grasp_phases, gate, threshold):
    scenario = scenario.with_settings({"grasp.gate": gate, "grasp.launch_probability": 0.8, "grasp.descent": "guided"})
    episode.phases = grasp_phases
    log = with_probability(episode.log(), lambda t: 0.1 * t)
    spans = phase_spans(log)
    strip, probability, across, _ = right_half(scenario, log, spans)
    assert strip.get_position().y0 > probability.get_position().y1 > across.get_position().y1
    assert probability.get_xlim() == strip.get_xlim() == across.get_xlim()
    curve, *lines = probability.lines
    times, percent = curve.get_xydata().T
    np.testing.assert_allclose(percent, 10.0 * times)
    assert times[-1] == pytest.approx(3.54, abs=0.031), "until the jaws hold"
    assert [list(line.get_ydata()) for line in lines] == ([threshold] if threshold else [])


def test_the_probability_of_a_blind_grasp_ends_at_the_launch(scenario, episode, grasp_phases):
    episode.phases = grasp_phases
    log = with_probability(episode.log(), lambda t: 0.1 * t)
    _, probability, _, _ = right_half(scenario, log, phase_spans(log))
    assert probability.lines[0].get_xdata()[-1] == pytest.approx(3.0, abs=0.031)


def test_a_log_of_an_earlier_version_has_no_probability_of_success(scenario, episode, grasp_phases, tmp_path):
    episode.phases = grasp_phases
    log = episode.log()
    diagnosis = log["diagnosis"]
    log["diagnosis"] = Signal(diagnosis.times, diagnosis.data[:, :-1], diagnosis.names[:-1])
    assert "p_success" not in log["diagnosis"].names
    assert len(right_half(scenario, log, phase_spans(log))) == 3
    assert draw(scenario, log, tmp_path / "tracking.png").shape == (1800, 3200, 3)


def test_motion_images(tmp_path):
    grey = np.tile(np.arange(60.0), (40, 1))
    images = MotionImages(grey, grey - 30.0, grey, grey, grey, np.where(grey > 30, 255, 0).astype(np.uint8))
    draw_motion_images({"left": images, "right": images}, tmp_path / "motion.png")
    image = cv2.imread(str(tmp_path / "motion.png"))
    assert abs(image.shape[1] - 3000) < 40 and image.shape[0] > 1000


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
