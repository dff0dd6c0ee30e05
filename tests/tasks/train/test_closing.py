"""Tests of the timing and position of the jaws when they closed."""

import numpy as np
import pytest

from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.train.closing import clearance, closing_onset_error, last_closing, offset_at_touch
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.setup import resolve

TRAVEL = 0.048 / 0.40
"""Time from the start of closing until the default jaws touch the train [s]."""


def test_clearance_is_half_the_difference_of_jaw_opening_and_train_width(scenario):
    assert clearance(resolve(scenario)) == pytest.approx(0.024)


def test_the_last_instant_follows_from_the_drift_of_the_hand(scenario, episode, grasp_phases, known):
    """The hand drifts sideways at 40 mm/s from the launch on and has lost the train 0.6 s later."""
    episode.phases = grasp_phases
    launch = known.tick(3.00)
    episode.beside = lambda t: 0.040 * np.maximum(t - launch, 0.0)
    log = episode.log()
    error = closing_onset_error(resolve(scenario), log, phase_spans(log))
    leaves = launch + 0.024 / 0.040
    assert error == pytest.approx(known.tick(3.30) - (leaves - TRAVEL), abs=0.003)


def test_closing_too_late_is_positive(scenario, episode, grasp_phases, known):
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.120 * np.maximum(t - known.tick(3.00), 0.0)
    log = episode.log()
    assert closing_onset_error(resolve(scenario), log, phase_spans(log)) > 0.2


def test_the_train_continues_by_its_speed_law_even_if_the_hand_stopped_it(scenario, episode, grasp_phases, known):
    """The effect of the grasp on the train is not considered: only the pose at the launch is ground truth."""
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.040 * np.maximum(t - known.tick(3.00), 0.0)
    log = episode.log()
    expected = closing_onset_error(resolve(scenario), log, phase_spans(log))
    truth = log["truth_train_state"]
    stopped = truth.times > 3.05
    truth.data[stopped, 4:6] = truth.data[stopped, 4:6][0]
    assert closing_onset_error(resolve(scenario), log, phase_spans(log)) == pytest.approx(expected, abs=1e-9)


def test_a_hand_that_stays_with_the_train_may_close_until_the_packet_ends(scenario, episode, grasp_phases, known):
    episode.phases = grasp_phases
    log = episode.log()
    spans = phase_spans(log)
    target = log["target"]
    stamp = target["stamp"][np.argmax(target.times >= spans[2].start)]
    error = closing_onset_error(resolve(scenario), log, spans)
    assert error == pytest.approx(known.tick(3.30) - (stamp + 1.5 - TRAVEL), abs=0.003)


def test_a_log_that_ends_early_is_continued_by_the_packet(scenario, episode, grasp_phases):
    episode.phases = grasp_phases
    log = episode.log()
    whole = closing_onset_error(resolve(scenario), log, phase_spans(log))
    episode.duration = 3.45
    log = episode.log()
    assert closing_onset_error(resolve(scenario), log, phase_spans(log)) == pytest.approx(whole, abs=0.003)


def test_a_run_without_closing(scenario, episode, nothing):
    log = episode.log()
    assert closing_onset_error(resolve(scenario), log, phase_spans(log)) is None
    assert offset_at_touch(resolve(scenario), log, phase_spans(log)) is None
    assert closing_onset_error(resolve(scenario), nothing, ()) is None


def test_a_hand_that_is_not_over_the_train_at_the_launch_is_not_judged(scenario, episode, grasp_phases):
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.030 + 0.0 * t
    log = episode.log()
    assert closing_onset_error(resolve(scenario), log, phase_spans(log)) is None


def test_offset_at_touch_is_the_position_of_the_train_in_the_hand(scenario, episode, grasp_phases, known):
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.030 + 0.0 * t
    log = episode.log()
    along, across, _ = offset_at_touch(resolve(scenario), log, phase_spans(log))
    assert (along, across) == pytest.approx((0.0, -0.030), abs=1e-6)  # the hand is left of the train


def test_offset_is_measured_at_the_first_contact(scenario, episode, grasp_phases):
    episode.phases = grasp_phases
    episode.beside = lambda t: 0.010 * t
    episode.verdict["left_contact"] = lambda t: (t >= 3.2).astype(float)
    log = episode.log()
    _, across, _ = offset_at_touch(resolve(scenario), log, phase_spans(log))
    assert across == pytest.approx(-0.032, abs=2e-4)


def test_the_last_of_several_attempts_is_judged(episode, grasp_phases):
    again = [(Phase.RETREAT, 3.54), (Phase.ACQUIRE, 4.2), (Phase.TRACK, 4.5)]
    episode.phases = [*grasp_phases[:4], *again, (Phase.INTERCEPT, 5.1), (Phase.CLOSE, 5.4)]
    launch, close = last_closing(phase_spans(episode.log()))
    assert (launch.phase, close.phase) == (Phase.INTERCEPT, Phase.CLOSE)
    assert 5.0 < launch.start < 5.1 < 5.3 < close.start < 5.4
