"""The state of a run, between the thread that simulates and those that serve the page."""

import json
from types import SimpleNamespace

import cv2
import numpy as np
from track_messages import track, track_points

from drake_tracker.core.constants import SIDES
from drake_tracker.core.messages import TrackState
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.live.pace import FRAME_INTERVAL
from drake_tracker.live.state import LONGEST_HISTORY, LiveState
from drake_tracker.run.track_marks import track_marks
from drake_tracker.run.video_page import CameraSight, PageState, VideoPage
from drake_tracker.tasks.style import bgr, track_light

SQUARE = np.array([[10.0, 10.0], [100.0, 10.0], [100.0, 60.0], [10.0, 60.0]])


def page_of(*sides):
    return VideoPage(dict.fromkeys(sides, SQUARE), (160, 120), "title", "subtitle", lag=0.25, goal="predicted crossing")


def test_news_has_only_what_was_not_sent_before():
    state = LiveState()
    state.set_facts(title="train")
    state.add_sample((0.0, 0, 1.5))
    news, seen, more = state.news(None, 0.0)
    assert news["facts"] == {"stage": "preparing", "title": "train"} and news["samples"] == [(0.0, 0, 1.5)] and more
    assert state.news(seen, 0.0) == (None, seen, True)
    state.set_values(time=0.05, phase=1)
    state.add_sample((0.05, 1, None))
    news, seen, _ = state.news(seen, 0.0)
    assert news == {"time": 0.05, "phase": 1, "samples": [(0.05, 1, None)]}
    state.close()
    assert state.news(seen, 60.0)[0] is None and not state.news(seen, 60.0)[2]


def test_a_page_that_is_opened_late_gets_the_whole_history():
    state = LiveState()
    for k in range(50):
        state.add_sample((k, 0))
    first, seen, _ = state.news(None, 0.0)
    assert len(first["samples"]) == 50
    state.add_sample((50, 0))
    state.set_values(time=50)
    assert state.news(seen, 0.0)[0]["samples"] == [(50, 0)]
    assert len(state.news(None, 0.0)[0]["samples"]) == 51


def test_the_samples_of_a_long_run_are_thinned_out_and_sent_again():
    state = LiveState()
    state.add_sample((0, 0))
    _, seen, _ = state.news(None, 0.0)
    for k in range(1, 3 * LONGEST_HISTORY):
        state.add_sample((k, 0))
    state.set_values(time=1.0)
    news, seen, _ = state.news(seen, 0.0)
    assert news["afresh"] and len(news["samples"]) <= LONGEST_HISTORY
    times = [time for time, _ in news["samples"]]
    assert times == sorted(times) and times[0] == 0 and times[-1] > 3 * LONGEST_HISTORY - 8
    state.set_values(time=2.0)
    assert "afresh" not in state.news(seen, 0.0)[0]


def test_a_frame_is_encoded_when_it_is_requested_and_holds_the_panels():
    state = LiveState()
    page = page_of("left", "right")
    state.frames.open(page)
    facts = state.news(None, 0.0)[0]["facts"]
    assert (facts["lag"], facts["goal"]) == (0.25, "predicted crossing")
    assert state.frames.jpeg() is None
    frame = np.zeros((page.size[1], page.size[0], 3), np.uint8)
    colours = {}
    for k, (side, late, (x, y, width, height)) in enumerate(page.panels):
        colours[side, late] = 50 * (k + 1)
        frame[y : y + height, x : x + width] = colours[side, late]
    page.draw = lambda sights, state: frame
    state.frames.write({}, None)
    image = cv2.imdecode(np.frombuffer(state.frames.jpeg(), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert len(facts["panels"]) == 4 and state.frames.jpeg() is state.frames.jpeg()
    for panel in facts["panels"]:
        x, y, width, height = panel["place"]
        shown = image[y + 9 : y + height - 9, x + 9 : x + width - 9]
        assert shown.size and abs(shown.astype(float) - colours[panel["side"], panel["late"]]).max() < 8


def test_frames_are_wanted_more_often_while_a_page_is_open():
    now = [0.0]
    counts = []
    for watched in (False, True):
        state = LiveState()
        state.frames._clock = lambda: now[0]
        if watched:
            state.watch(True)
        state.frames.open(page_of(""))
        for _ in range(300):
            state.frames.write({}, None)
            now[0] += 1 / 100
        counts.append(state.frames.number)
    assert 3 <= counts[0] <= 4 and abs(counts[1] - 3.0 / FRAME_INTERVAL) <= 4


def test_the_last_page_that_closes_is_noticed():
    state = LiveState()
    state.watch(True)
    state.watch(True)
    state.watch(False)
    assert not state.left
    state.watch(False)
    assert state.left
    state.watch(True)
    assert not state.left


def test_the_tracks_of_the_newest_frame_are_told_with_their_places_in_the_panels():
    state = LiveState()
    page = VideoPage(dict.fromkeys(SIDES, SQUARE), (160, 120), "title", "subtitle", lag=0.25, several=True)
    assert not state.frames.several and state.frames.tracks() == ([], "")
    state.frames.open(page)
    assert state.frames.several and state.news(None, 0.0)[0]["facts"]["several"]
    message = track_points(0.75, [track(1, 0.05, 0.03, vx=0.04), track(3, 0.08, 0.04, state=TrackState.OCCLUDED)], 1)
    camera = SimpleNamespace(project=lambda p_WQ: 1e3 * np.asarray(p_WQ)[:, :2])
    image = np.zeros((120, 160, 3), np.uint8)
    sight = CameraSight(image, (0, 0), np.zeros((0, 2)), image, None, None, tracks=track_marks(message, camera, 1.0))
    frame = PageState(1.0, Phase.TRACK, ("", ""), 0.75, reason="the target is not seen")
    state.frames.write(dict.fromkeys(SIDES, sight), frame)
    (first, second), reason = state.frames.tracks()
    assert reason == "the target is not seen"
    assert (first["number"], first["target"], first["state"], first["speed"]) == (1, True, "moving", 0.04)
    assert (second["number"], second["target"], second["seen"], second["size"]) == (3, False, False, 0.1)
    json.dumps([first, second])
    drawn = cv2.imdecode(np.frombuffer(state.frames.jpeg(), np.uint8), cv2.IMREAD_COLOR)
    facts = state.news(None, 0.0)[0]["facts"]
    for panel, (x, y) in zip(facts["panels"], first["at"]):
        left, top, width, height = panel["place"]
        assert 0 < x < width and 0 < y < height
        spot = drawn[round(top + y) - 1 : round(top + y) + 2, round(left + x) - 1 : round(left + x) + 2]
        assert np.abs(spot.mean(axis=(0, 1)) - bgr(track_light(1))).max() < 40, "the mark is there"
