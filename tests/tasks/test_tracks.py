"""What a log tells about the tracks of several objects."""

import numpy as np
import pytest
from track_messages import track, track_points, tracks_signal

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import TrackState
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.tracks import (
    STATE_WORDS,
    logged_tracks,
    reason_shares,
    reason_words,
    tell_reasons,
    track_rows,
)
from drake_tracker.vision.silhouettes.target import REASONS, Reason


def message(k):
    """Object 1 is the target and is covered from cycle 60 to 79; object 2 stands, and appears in cycle 50."""
    hidden = 60 <= k < 80
    first = track(1, 0.5 + 0.001 * k, state=TrackState.OCCLUDED if hidden else TrackState.MOVING, vx=0.06)
    second = [track(2, 0.6, 0.1, state=TrackState.STANDING, size=0.05)] if k >= 50 else []
    reason = Reason.OCCLUDED if hidden else Reason.NONE
    return track_points(VISION_PERIOD * (k + 1), [first, *second], 1, reason)


LOG = {"tracks": tracks_signal(message, 100)}


def test_every_state_has_words():
    assert set(STATE_WORDS) == set(TrackState) - {TrackState.NONE}


def test_the_tracks_of_a_message():
    first, second = track_rows(message(70))
    assert (first.number, first.target, first.seen, first.state) == (1, True, False, TrackState.OCCLUDED)
    assert (second.number, second.target, second.seen) == (2, False, True) and second.size == pytest.approx(0.05)
    assert first.p_WQ == pytest.approx([0.57, 0.0, 0.485]) and first.v_WQ == pytest.approx([0.06, 0.0, 0.0])
    assert reason_words(message(70)) == REASONS[Reason.OCCLUDED] and reason_words(message(0)) == ""
    assert reason_words(np.zeros_like(message(0))) == "" and track_rows(np.zeros_like(message(0))) == []


@pytest.mark.parametrize("state, number", [(9, 1), (np.nan, 1), (1.5, 1), (1, -2), (1, np.inf)])
def test_a_track_that_cannot_be_is_left_out(state, number):
    assert track_rows(track_points(0.1, [track(number, state=state)])) == []


def test_the_tracks_of_a_log():
    first, second = logged_tracks(LOG)
    assert (first.number, second.number) == (1, 2) and (len(first.times), len(second.times)) == (100, 50)
    assert np.count_nonzero(~first.seen) == 20 and second.seen.all()
    assert (first.target_share, second.target_share) == (1.0, 0.0)
    assert first.xyz[-1] == pytest.approx([0.599, 0.0, 0.485]) and second.times[0] == pytest.approx(51 * VISION_PERIOD)


def test_the_tracks_of_a_log_that_does_not_tell_directions():
    """Such logs were written before tracks had the fields ``yaw`` and ``yaw_known``."""
    signal = LOG["tracks"]
    kept = [k for k, name in enumerate(signal.names) if "yaw" not in name]
    old = {"tracks": Signal(signal.times, signal.data[:, kept], tuple(signal.names[k] for k in kept))}
    assert len(kept) < len(signal.names)
    first, second = logged_tracks(old)
    assert first.xyz.tolist() == logged_tracks(LOG)[0].xyz.tolist() and len(second.times) == 50
    assert reason_shares(old) == reason_shares(LOG)


def test_the_reasons_of_a_log():
    assert reason_shares(LOG) == {Reason.OCCLUDED: pytest.approx(0.2)}
    assert reason_shares(LOG, lambda stamps: stamps < 0.5) == {}
    assert tell_reasons(reason_shares(LOG)).endswith("covers the target (20%)")
    assert tell_reasons({}) == ""


def test_a_log_without_tracks_tells_nothing():
    assert logged_tracks({}) == [] and reason_shares({}) == {}
