"""Tests of the sentence that says why the train was not lifted."""

from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.train.closing import aborted_launches
from drake_tracker.tasks.train.diagnosis.failure import GATE_WORDS, activity, failure_reason
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.vision.silhouettes.target import REASONS, Reason


def reason(episode, valid_fraction=1.0, interrupted=False):
    log = episode.log()
    return failure_reason(resolve(episode.scenario), log, phase_spans(log), valid_fraction, interrupted)


def after(time):
    return lambda t: (t >= time).astype(float)


def between(start, end):
    return lambda t: ((t >= start) & (t < end)).astype(float)


def test_every_gate_has_a_clause():
    assert set(GATE_WORDS) == set(Gate)


def test_the_progress_line_says_what_the_arm_waits_for():
    assert activity(Phase.TRACK, Gate.STALE) == "track: waiting for a fresh prediction"
    assert activity(Phase.TRACK, Gate.OPEN) == "track"
    assert activity(Phase.LIFT, Gate.NOT_TRACKING) == "lift"
    assert activity(Phase.ACQUIRE, Gate.NOT_TRACKING) == "acquire: waiting for the train to be seen"
    waiting = set(Gate) - {Gate.OPEN, Gate.NOT_TRACKING}
    covered = REASONS[Reason.OCCLUDED]
    assert activity(Phase.TRACK, Gate.STALE, covered) == f"track: {covered}"
    assert activity(Phase.ACQUIRE, Gate.NOT_TRACKING, covered) == f"acquire: {covered}"
    assert activity(Phase.LIFT, Gate.NOT_TRACKING, covered) == "lift", "vision is not in use"
    assert all(": waiting for " in activity(Phase.TRACK, gate) for gate in waiting)


def test_a_success_has_no_reason(episode):
    episode.verdict["taken"] = after(5.0)
    assert reason(episode) is None


def test_never_tracked(episode):
    episode.phases = [(Phase.ACQUIRE, 0.0)]
    assert reason(episode, 0.03) == "the train was never tracked: vision gave a valid point in 3% of the cycles"
    assert reason(episode, None) == "the train was never tracked: vision gave a valid point in no cycle"
    assert reason(episode, 1.0) == "the hand never followed the train, although vision saw it"


def test_gate_never_opened(episode):
    episode.gate = Gate.PREDICTIONS_FAILED
    text = reason(episode)
    assert text == (
        "the gate never opened in 5.0 s of tracking: earlier predictions from the same place had not come true "
        "(100% of that time)"
    )


def test_missed(episode, grasp_phases):
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9), (Phase.ACQUIRE, 4.8)]
    episode.beside = lambda t: 0.031 + 0.0 * t
    text = reason(episode)
    assert text == (
        "attempt 1 missed: at contact the train was 31 mm across and 0 mm along the jaws from their middle; "
        "at most 24 mm across is possible"
    )


@pytest.mark.parametrize("half_turns", [0, 1])
def test_missed_because_the_train_lay_obliquely(episode, grasp_phases, half_turns):
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9), (Phase.ACQUIRE, 4.8)]
    episode.turned = np.pi * half_turns - np.radians(31.0)
    assert "0 mm along the jaws from their middle, turned by 31 deg; at most 24 mm across is" in reason(episode)


def test_missed_because_the_jaws_were_ahead(episode, grasp_phases):
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9), (Phase.ACQUIRE, 4.8)]
    predicted = episode.predicted
    episode.predicted = lambda t: predicted(t) + [0.0, 0.07, 0.0, 0.0]
    assert "70 mm along the jaws from their middle; at most 24 mm across and 60 mm along are possible" in reason(
        episode
    )


def test_missed_and_tracked_again(episode, grasp_phases):
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9), (Phase.ACQUIRE, 4.2), (Phase.TRACK, 4.5)]
    assert "afterwards the gate did not open again in 1.5 s of tracking" in reason(episode)


def test_thrown_off(episode, grasp_phases):
    """A train beside its track is not grasped again: nothing is said about the gate afterwards."""
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9), (Phase.ACQUIRE, 4.2), (Phase.TRACK, 4.5)]
    episode.verdict["derailed"] = after(3.5)
    text = reason(episode)
    assert text.startswith("attempt 1 missed and threw the train off its track: at contact")
    assert "afterwards" not in text


def test_dropped(episode, grasp_phases):
    episode.phases = [*grasp_phases[:5], (Phase.RETREAT, 4.2)]
    episode.verdict["left_contact"] = episode.verdict["right_contact"] = between(3.4, 4.1)
    episode.verdict["lift"] = lambda t: np.clip(0.1 * (t - 3.5), 0.0, 0.05)
    assert reason(episode) == "attempt 1 gripped the train but dropped it at a height of at most 50 mm"


def test_the_run_ended_while_the_train_was_held(episode, grasp_phases):
    episode.phases = grasp_phases
    episode.verdict["left_contact"] = episode.verdict["right_contact"] = after(3.4)
    episode.verdict["lift"] = lambda t: np.clip(0.15 * (t - 3.5), 0.0, 0.15)
    episode.verdict["held"] = lambda t: np.clip(t - 5.4, 0.0, None)
    assert reason(episode) == ("attempt 1 held the train at a height of 150 mm, but for only 0.60 s when the run ended")


def test_an_aborted_attempt(episode, grasp_phases):
    before = grasp_phases[:3]
    episode.phases = [*before, (Phase.RETREAT, grasp_phases[3][1])]
    assert reason(episode) == "attempt 1 was aborted during the descent: success had become unlikely"
    assert aborted(episode) == (pytest.approx(before[-1][1], abs=0.01),)
    episode.phases = grasp_phases
    assert aborted(episode) == ()


def test_an_attempt_aborted_while_the_jaws_begin_to_close(episode, grasp_phases):
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, grasp_phases[3][1] + 0.1)]
    assert aborted(episode, jaw_width=0.08) == (pytest.approx(grasp_phases[2][1], abs=0.01),)
    assert aborted(episode, jaw_width=0.03) == ()


def aborted(episode, jaw_width=0.04):
    """Returns the launches that were aborted, if the jaws are asked for this opening [m] throughout."""
    log = episode.log()
    command = log["command"]
    data = command.data.copy()
    data[:, command.names.index("jaw_width")] = jaw_width
    return aborted_launches(phase_spans(log), {**log, "command": replace(command, data=data)}, 0.04)


@pytest.mark.parametrize(
    "count, words",
    [
        (3, "the run ended during the descent of attempt 1"),
        (4, "the run ended while the jaws of attempt 1 were closing"),
    ],
)
def test_the_run_ended_during_an_attempt(episode, grasp_phases, count, words):
    episode.phases = grasp_phases[:count]
    assert reason(episode) == words


def test_an_interrupted_run_says_how_far_it_got(episode):
    assert reason(episode, interrupted=True).startswith("interrupted; until then the gate never opened")


def test_a_run_that_was_interrupted_at_once(scenario, nothing):
    assert "never tracked" in failure_reason(resolve(scenario), nothing, (), None, True)
