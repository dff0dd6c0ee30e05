"""Tests of the picture of a grasp: which instants it shows, and where it draws what was known at them."""

import cv2
import numpy as np
import pytest
from made_up_run import TRAIN_Z
from track_messages import regions, track, track_points

from drake_tracker.core.constants import SIDES
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import Regions, TrackPoints, TrackState
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.filming import Frame
from drake_tracker.tasks.train.closing import LATEST, contact_of
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.pictures.grasp_figure import draw_grasp, grasp_figure
from drake_tracker.tasks.train.pictures.grasp_instants import COUNT, SPAN, choose_frames, grasp_instants
from drake_tracker.tasks.train.setup import resolve

OFFSET = (20, 10)
OFFSETS = dict.fromkeys(SIDES, OFFSET)
FRAME_PERIOD = 2 * VISION_PERIOD


def frames_until(end):
    image = np.full((120, 130, 3), 60, np.uint8)
    return [Frame(k * FRAME_PERIOD, dict.fromkeys(SIDES, image)) for k in range(round(end / FRAME_PERIOD))]


@pytest.fixture
def run(scenario, episode, grasp_phases):
    """A run with a contact at 3.4 s; its hand, above the train, sinks by 0.1 m/s."""
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.004 + 0.0 * t
    episode.verdict["left_contact"] = lambda t: (t > 3.399).astype(float)
    return scenario, episode, episode.log()


def with_tracks(log, episode, state=TrackState.MOVING):
    """The log of the same run with a vision of several objects: object 3 is the target, object 4 is beside it."""
    stamps = VISION_PERIOD * np.arange(300)

    def place(stamp):
        ((x, y),) = episode.place(np.array([stamp]))
        return x, y

    tracks = [
        track_points(t, [track(4, 0.3, 0.1), track(3, *place(t), state=state if t > 3.3 else TrackState.MOVING)], 3)
        for t in stamps
    ]
    found = [regions(t, (40.0, 30.0, 9.0, 7.0, 4), (50.0 + 10.0 * t, 60.0, 20.0, 10.0, 3)) for t in stamps]
    appears = stamps + 0.25
    several = {"tracks": Signal(appears, np.array(tracks), tuple(TrackPoints.get_fields()))}
    for side in SIDES:
        several[f"regions_{side}"] = Signal(appears, np.array(found), tuple(Regions.get_fields()))
    return {**log, **several}


def instants_of(scenario, log, cameras, frames):
    spans = phase_spans(log, scenario.time_step)
    contact = contact_of(resolve(scenario), log, spans)
    return contact, grasp_instants(contact, spans, log, frames, cameras, OFFSETS)


def test_the_contact_is_the_first_one_since_the_launch(run):
    scenario, _, log = run
    contact = contact_of(resolve(scenario), log, phase_spans(log))
    assert contact.made and contact.time == pytest.approx(3.4, abs=1e-6)


@pytest.mark.parametrize("since", [1.0, 9.0])
def test_without_a_contact_it_is_when_the_pads_would_have_touched(scenario, episode, grasp_phases, since):
    """A contact that ended before the launch, or came long after the closing, is not that of the attempt."""
    episode.phases = grasp_phases
    episode.verdict["left_contact"] = lambda t: ((t > since) & (t < since + 0.5)).astype(float)
    log = episode.log()
    (close,) = (span.start for span in phase_spans(log) if span.phase == Phase.CLOSE)
    contact = contact_of(resolve(scenario), log, phase_spans(log))
    assert not contact.made and contact.time == pytest.approx(close + touch_delay(scenario.grasp))
    assert touch_delay(scenario.grasp) + LATEST < 1.0


def test_the_instants_are_spaced_evenly_up_to_the_contact(run, small_laboratory):
    scenario, _, log = run
    contact, instants = instants_of(scenario, log, small_laboratory.cameras, frames_until(6.0))
    assert len(instants) == COUNT == 6
    assert [instant.before for instant in instants] == pytest.approx(np.linspace(SPAN, 0.0, COUNT), abs=0.51 / 30)
    assert [instant.time + instant.before for instant in instants] == pytest.approx([contact.time] * COUNT)
    phases = [Phase.TRACK, *3 * [Phase.INTERCEPT], *2 * [Phase.CLOSE]]
    assert [instant.phase for instant in instants] == phases


def test_an_instant_of_which_no_frame_was_kept_is_left_out():
    frames = frames_until(6.0)
    late = [frame for frame in frames if frame.time > 3.05]
    assert [frame.time for frame in choose_frames(late, 3.4)] == pytest.approx([3.1, 3.2, 3.3, 3.4], abs=0.51 / 30)
    assert choose_frames(frames, 9.0) == [] and choose_frames([], 3.4) == []


def test_the_marks_are_where_the_cameras_project_what_was_known(run, small_laboratory):
    scenario, episode, log = run
    cameras = small_laboratory.cameras
    contact, instants = instants_of(scenario, with_tracks(log, episode), cameras, frames_until(6.0))
    figure = grasp_figure(resolve(scenario), contact, instants)
    (x, y, z, yaw) = episode.predicted(np.array([contact.time]))[0]
    place = np.array([x, y, z])
    drawn = {side: figure.axes[row * COUNT : (row + 1) * COUNT] for row, side in enumerate(SIDES)}
    for k, instant in enumerate(instants):
        assert instant.seen
        here, half = episode.predicted(np.array([instant.time]))[0], 0.044 * np.array([-np.sin(yaw), np.cos(yaw), 0.0])
        true = [*episode.place(np.array([instant.time]))[0], TRAIN_Z]
        for side, axes in drawn.items():
            marks = {line.get_gid(): line.get_xydata() for line in axes[k].lines}
            project = cameras[side].project
            np.testing.assert_allclose(marks["contact"], project(place), atol=1e-6)
            np.testing.assert_allclose(marks["point"], project(true), atol=1e-6)
            np.testing.assert_allclose(marks["jaws"], project([here[:3] + half, here[:3] - half]), atol=1e-6)
            corners = marks["outline"]
            np.testing.assert_allclose(corners.mean(axis=0)[1], 60.0, atol=2.5)
            assert np.ptp(corners, axis=0) == pytest.approx([20.0, 10.0])
            assert corners[:4].mean(axis=0) == pytest.approx([50.0 + 10.0 * instant.time, 60.0])
            left, right, bottom, top = axes[k].images[0].get_extent()
            assert (left, top) == (OFFSET[0] - 0.5, OFFSET[1] - 0.5), "pixel (0, 0) of the image is at its offset"
            assert (right - left, bottom - top) == (130, 120)
            assert axes[k].get_xlim()[0] < marks["contact"][0, 0] < axes[k].get_xlim()[1]
            assert axes[k].get_ylim()[1] < marks["contact"][0, 1] < axes[k].get_ylim()[0]
        assert {axes[k].get_xlim() for k in range(COUNT)} == {axes[0].get_xlim()}, "the same part of every image"


def test_the_packet_is_the_one_that_the_arm_followed(run, small_laboratory):
    """The packet of a blind descent grows old; one that was right at first shows where the object was expected then."""
    scenario, episode, _ = run
    episode.beside = lambda t: 0.004 + 0.02 * (t > 3.2)
    log = episode.log()
    _, instants = instants_of(scenario, log, small_laboratory.cameras, frames_until(6.0))
    ages = np.array([instant.age for instant in instants])
    launch = [instant.phase != Phase.TRACK for instant in instants].index(True)
    assert np.diff(ages[launch:]) == pytest.approx(0.1, abs=0.51 / 30 * 2)
    assert ages[0] == pytest.approx(0.27, abs=0.04) and ages[-1] > 0.6


def test_an_object_that_vision_did_not_see_is_marked_as_expected_only(run, small_laboratory):
    scenario, episode, log = run
    log = with_tracks(log, episode, TrackState.OCCLUDED)
    contact, instants = instants_of(scenario, log, small_laboratory.cameras, frames_until(6.0))
    assert [instant.seen for instant in instants] == [instant.time <= 3.3 for instant in instants]
    figure = grasp_figure(resolve(scenario), contact, instants)
    faces = [
        next(line for line in axes.lines if line.get_gid() == "point").get_markerfacecolor()
        for axes in figure.axes[:COUNT]
    ]
    assert faces[-1] == "none" and faces[0] != "none"


def test_a_vision_of_one_object_reports_its_centroids(run, small_laboratory):
    scenario, _, log = run
    stamps = VISION_PERIOD * np.arange(300)
    for side in SIDES:
        rows = np.column_stack([stamps, 40.0 + stamps, 0.0 * stamps + 55.0, 0.0 * stamps + 30.0, stamps < 3.25])
        log[f"centroid_{side}"] = Signal(stamps + 0.25, rows, log[f"centroid_{side}"].names)
    _, instants = instants_of(scenario, log, small_laboratory.cameras, frames_until(6.0))
    for instant in instants:
        valid = instant.time < 3.25
        assert instant.seen == valid
        for sight in instant.sights.values():
            assert len(sight.outline) == 0
            assert sight.point == pytest.approx([40.0 + instant.time, 55.0] if valid else [np.nan] * 2, nan_ok=True)


def test_the_picture_is_drawn_only_for_an_attempt(run, nothing, small_laboratory, tmp_path):
    scenario, episode, log = run
    cameras, frames = small_laboratory.cameras, frames_until(6.0)
    draw_grasp(resolve(scenario), cameras, OFFSETS, frames, log, tmp_path / "grasp.png")
    image = cv2.imread(str(tmp_path / "grasp.png"))
    assert image.shape[1] == 2400 and (image < 250).any(axis=2).mean() > 0.5
    episode.phases = episode.phases[:2]
    for other in (episode.log(), nothing):
        draw_grasp(resolve(scenario), cameras, OFFSETS, frames, other, tmp_path / "none.png")
    draw_grasp(resolve(scenario), cameras, OFFSETS, frames[:3], log, tmp_path / "none.png")
    assert [path.name for path in tmp_path.iterdir()] == ["grasp.png"]
