"""Tests of the cause of a failure, found in logs that each show one kind of trouble."""

from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.arm.safety.packet_guard import Rejection
from drake_tracker.core.log import Signal
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.train.diagnosis.cause import main_trouble
from drake_tracker.tasks.train.diagnosis.failure import explain_failure
from drake_tracker.tasks.train.diagnosis.trouble import Cause, stretches
from drake_tracker.tasks.train.diagnosis.trouble_signals import rejected_packets
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import summarise
from drake_tracker.tasks.train.task import TASK


def changed(log, name, **fields):
    """Returns a log in which fields of one signal are what functions of its times return."""
    signal = log[name]
    data = signal.data.copy()
    for field, values in fields.items():
        column = signal.names.index(field)
        data[:, column] = values(signal.times, data[:, column])
    return log | {name: replace(signal, data=data)}


def during(start, end, value):
    """Returns a function of (times, values) that replaces the values from ``start`` to ``end`` [s]."""
    return lambda t, old: np.where((t >= start) & (t < end), value, old)


def held(start, end):
    """Returns a function of (times, values) that keeps the value of ``start`` until ``end`` [s]."""

    def function(t, old):
        first = np.searchsorted(t, start)
        return np.where((t >= start) & (t < end), old[first], old)

    return function


def found(episode, log):
    return main_trouble(resolve(episode.scenario), log, phase_spans(log))


def assert_found(episode, log, cause, start, end, words):
    trouble = found(episode, log)
    assert trouble is not None and trouble.cause is cause, trouble
    assert trouble.start == pytest.approx(start, abs=0.06) and trouble.end == pytest.approx(end, abs=0.06)
    assert words in trouble.sentence


def test_stretches_bridge_short_gaps_and_skip_short_spells():
    times = np.arange(20) / 10.0
    present = np.isin(np.arange(20), [2, 3, 5, 6, 7, 12, 16, 17, 18])
    assert stretches(times, present, 0.2, 0.2) == [pytest.approx((0.2, 0.7)), pytest.approx((1.6, 1.8))]
    assert stretches(times, np.zeros(20, bool), 0.0) == []


def test_a_normal_run_shows_no_trouble(episode, grasp_phases):
    log = episode.log()
    assert found(episode, log) is None
    assert explain_failure(resolve(episode.scenario), log, phase_spans(log), 1.0, False).cause is Cause.NOT_LEARNED
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9)]
    log = changed(episode.log(), "jaws", width=during(3.3, 9.0, 0.0))
    assert explain_failure(resolve(episode.scenario), log, phase_spans(log), 1.0, False).cause is Cause.MISSED


@pytest.mark.parametrize("speed, cause, words", [
    (0.0, Cause.TRAIN_STOPPED, "the train stood still"),
    (-0.1, Cause.TRAIN_REVERSED, "the train ran backwards"),
    (0.3, Cause.TRAIN_DISPLACED, "the train was pushed"),
])  # fmt: skip
def test_a_train_that_does_not_follow_its_speed_law(episode, speed, cause, words):
    log = changed(episode.log(), "truth_train_state", vy=during(2.0, 4.0, speed))
    assert_found(episode, log, cause, 2.0, 4.0, words)


def test_a_train_that_is_carried_to_another_place_on_its_track(episode):
    log = changed(episode.log(), "truth_verdict", lift=during(2.0, 3.0, 0.06))
    assert_found(episode, log, Cause.TRAIN_DISPLACED, 2.0, 3.0, "the train was moved")


def test_a_train_that_is_carried_away(episode):
    log = changed(episode.log(), "truth_verdict", lift=during(2.0, 9.0, 0.2))
    assert_found(episode, log, Cause.TRAIN_DISPLACED, 2.0, 6.0, "the train was moved off its track")
    log = changed(log, "truth_train_state", x=lambda t, x: x + 1.0 * (t >= 2.0))
    assert_found(episode, log, Cause.TRAIN_LOST, 2.0, 6.0, "the train was taken away")


def test_a_train_beside_its_track(episode):
    log = changed(episode.log(), "truth_verdict", derailed=during(2.0, 9.0, 1.0))
    log = changed(log, "truth_train_state", x=lambda t, x: x + 0.05 * (t >= 2.0))
    assert_found(episode, log, Cause.DERAILED, 2.0, 6.0, "the train was off its track")


def test_the_trouble_that_lasted_longest_is_the_cause(episode):
    """A second object that stood in the way for half a minute was hidden by a host that hesitated for 0.3 s."""
    episode.offsets = lambda t: np.column_stack([0.1 * np.sin(1.5 * t), 0.1 * np.cos(1.5 * t)])
    short = {name: held(2.0, 2.7) for name in ("stamp", "seq", "first_time")}
    log = changed(changed(episode.log(), "prediction", **short), "delivered", **short)
    assert found(episode, log).cause is Cause.SECOND_OBJECT


def test_all_causes_that_were_found_are_named(episode):
    stopped = held(2.0, 4.5)
    log = changed(episode.log(), "prediction", stamp=stopped, seq=stopped, first_time=stopped)
    log = changed(log, "delivered", stamp=stopped, seq=stopped, first_time=stopped)
    log = changed(log, "truth_train_state", vy=during(3.0, 5.0, 0.0))
    failure = explain_failure(resolve(episode.scenario), log, phase_spans(log), 1.0, False)
    assert failure.cause is Cause.TRAIN_STOPPED and failure.further == (Cause.HOST,)
    assert failure.reason.startswith("the train stood still from 3.0") and "; also the host" in failure.reason


def test_a_train_that_the_hand_pushed_off_its_track_was_missed(episode, grasp_phases):
    episode.phases = grasp_phases[:4]
    episode.verdict = {"left_contact": lambda t: (t >= 3.4) * 1.0, "derailed": lambda t: (t >= 3.6) * 1.0}
    log = changed(episode.log(), "truth_train_state", x=lambda t, x: x + 0.05 * (t >= 3.6))
    log = changed(log, "jaws", width=during(3.3, 9.0, 0.0))
    failure = explain_failure(resolve(episode.scenario), log, phase_spans(log), 1.0, False)
    assert failure.cause is Cause.MISSED and "threw the train off its track" in failure.reason


def test_a_host_that_stops(episode):
    log = episode.log()
    stopped = {name: held(2.0, 4.0) for name in ("stamp", "seq", "first_time")}
    log = changed(changed(log, "prediction", **stopped), "delivered", **stopped)
    assert_found(episode, log, Cause.HOST, 2.2, 4.0, "the host made no prediction")


def test_a_host_that_never_predicts(episode):
    episode.duration = 7.5
    log = episode.log()
    for name in ("prediction", "delivered"):
        log = changed(log, name, valid=during(0.0, 99.0, 0.0))
    assert_found(episode, log, Cause.HOST, 0.3, 7.5, "never made a prediction")


def report_of_rejections(reason, start, end):
    """A signal ``packet_report`` in which a packet is rejected every 30 ms of a stretch of time [s]."""
    names = TASK.signals()["packet_report"][1]
    times = np.arange(0.0, 6.0, 0.03)
    rejected = np.cumsum((times >= start) & (times <= end))
    rows = np.zeros((len(times), len(names)))
    rows[:, names.index("rejected")], rows[:, names.index("reason")] = rejected, reason * (rejected > 0)
    return {"packet_report": Signal(times, rows, tuple(names))}


def test_a_host_whose_packets_are_rejected(episode):
    log = episode.log() | report_of_rejections(Rejection.BELOW_TABLE, 2.0, 4.0)
    assert_found(episode, log, Cause.HOST, 2.0, 4.0, "the arm rejected packets: the path leads below the table")
    stray = episode.log() | report_of_rejections(Rejection.BELOW_TABLE, 2.0, 2.1)
    assert rejected_packets(stray, 6.0) == []
    late = episode.log() | report_of_rejections(Rejection.PAST, 2.0, 4.0)
    assert rejected_packets(late, 6.0) == []


def test_a_link_that_delays_and_one_that_delivers_nothing(episode):
    log = changed(episode.log(), "delivered", stamp=lambda t, stamp: stamp - 0.4 * (t >= 3.0))
    assert_found(episode, log, Cause.LINK, 3.0, 6.0, "up to 0.4 s older than the host's")
    log = changed(episode.log(), "delivered", valid=during(0.0, 99.0, 0.0))
    assert_found(episode, log, Cause.LINK, 0.3, 6.0, "no packet of the host reached the arm")


def test_link_trouble_is_not_called_settling(episode):
    """With a delay of 5 s the reason was that the train was never tracked, although vision saw it in every cycle."""
    episode.phases, episode.gate = [(Phase.ACQUIRE, 0.0)], Gate.NOT_TRACKING
    log = changed(episode.log(), "delivered", valid=during(0.0, 99.0, 0.0))
    reason = summarise(resolve(episode.scenario), log, 6.0)["failure_reason"]
    assert reason.startswith("no packet of the host reached the arm from 0.3 to 6.0 s")


def test_an_open_track_comes_to_its_end(episode):
    episode.duration = 9.0
    assert_found(episode, episode.log(), Cause.TRACK_END, 7.9, 9.0, "the train stood at the end of its track")


@pytest.mark.parametrize("phase, words", [(Phase.STOPPED, "stopped the arm"), (Phase.MANUAL, "taken over the arm")])
def test_an_operator_who_has_the_arm(episode, phase, words):
    episode.phases = [
        (Phase.ACQUIRE, 0.0),
        (Phase.TRACK, 1.02),
        (phase, 2.0),
        (Phase.RETREAT, 4.0),
        (Phase.ACQUIRE, 5.0),
    ]
    assert_found(episode, episode.log(), Cause.OPERATOR, 2.0, 4.0, f"the operator had {words}")


def test_a_camera_that_sees_nothing(episode):
    log = episode.log()
    for side in ("left", "right"):
        log = changed(log, f"centroid_{side}", stamp=lambda t, _: t - 0.25, valid=during(0.0, 99.0, 1.0))
    dark = changed(log, "centroid_left", valid=during(2.25, 4.25, 0.0))
    assert_found(episode, dark, Cause.CAMERA, 2.0, 4.0, "the left camera did not see the moving train")


def test_measured_vision_that_sees_nothing(episode):
    episode.valid = lambda t: 1.0 - ((t >= 2.0) & (t < 4.0))
    log = {name: signal for name, signal in episode.log().items() if not name.startswith("centroid")}
    assert_found(episode, log, Cause.CAMERA, 2.0, 4.0, "vision did not see the moving train")


def test_points_beside_the_train(episode):
    episode.offsets = lambda t: np.column_stack([0.0 * t, 0.025 + 0.0 * t])
    assert found(episode, episode.log()).cause is Cause.CALIBRATION
    episode.offsets = lambda t: np.column_stack([0.1 * np.sin(1.5 * t), 0.1 * np.cos(1.5 * t)])
    assert found(episode, episode.log()).cause is Cause.SECOND_OBJECT
    # A shadow pulls the points to one side, but only while it passes.
    episode.offsets = lambda t: np.column_stack([0.0 * t, 0.04 * (np.mod(t, 3.0) < 1.5)])
    assert found(episode, episode.log()).cause is Cause.SECOND_OBJECT
    # So does a short leap, which no window of a second shows.
    episode.offsets = lambda t: np.column_stack([0.0 * t, 0.10 * ((t > 2.7) & (t < 3.2))])
    assert_found(
        episode, episode.log(), Cause.SECOND_OBJECT, 2.7, 3.2, "vision followed something 100 mm from the train"
    )
    # Rays that keep missing each other show that a camera was turned, however short the time.
    episode.offsets = lambda t: np.column_stack([0.0 * t, 0.033 * ((t > 2.1) & (t < 3.9))])
    assert found(episode, episode.log()).cause is Cause.SECOND_OBJECT
    log = changed(episode.log(), "point", gap=during(2.3, 9.0, 0.011))
    assert found(episode, log).cause is Cause.CALIBRATION
    noise = np.random.default_rng(1).normal(0.0, 0.02, (2000, 2))
    episode.offsets = lambda t: noise[: len(t)]
    assert found(episode, episode.log()).cause is Cause.IMAGE_DISTURBED


def test_a_joint_that_does_not_follow(episode):
    log = changed(episode.log(), "arm_state", q3=during(2.0, 2.5, 0.2))
    assert_found(episode, log, Cause.ARM, 2.0, 2.5, "joint 3 was up to 0.20 rad from its set-point")


def test_slow_and_weak_jaws(episode, grasp_phases):
    episode.phases = [*grasp_phases[:4], (Phase.RETREAT, 3.9)]
    log = changed(episode.log(), "command", jaw_width=lambda t, _: np.clip(0.088 - 0.4 * (t - 3.3), 0.0, 0.088))
    slow = changed(log, "jaws", width=lambda t, _: np.clip(0.088 - 0.05 * (t - 3.3), 0.0, 0.088))
    assert found(episode, slow).clause == "the jaws closed more slowly than commanded"
    weak = changed(
        log, "jaws", width=lambda t, _: np.clip(0.088 - 0.4 * (t - 3.3), 0.04, 0.088), force=during(0, 9, 3.0)
    )
    assert found(episode, weak).clause == "the jaws pressed on the train with too little force"
    strong = changed(weak, "jaws", force=during(0.0, 9.0, 25.0))
    assert found(episode, strong) is None


def test_trouble_that_was_over_long_before_the_descent_is_not_the_cause(episode, grasp_phases):
    episode.duration = 7.5
    episode.phases = [(phase, time + 3.0 * (time > 2.0)) for phase, time in grasp_phases[:4]]
    log = changed(episode.log(), "delivered", stamp=lambda t, stamp: stamp - 0.4 * ((t >= 1.5) & (t < 2.0)))
    log = changed(log, "jaws", width=during(6.3, 9.0, 0.0))
    assert found(episode, log) is None
