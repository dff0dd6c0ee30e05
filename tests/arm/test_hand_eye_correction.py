"""Tests of the correction of the target by what the cameras see of the hand."""

import numpy as np
import pytest
from variants import variant

from drake_tracker.arm.config import HandEyeConfig
from drake_tracker.arm.hand_eye_correction import LEAST, OUTLIERS, Doubt, HandEyeCorrection, describe_doubt
from drake_tracker.core.messages import HandCorrection, HandPoint, ServoTarget, message_size

PERIOD, LAG = 1 / 60, 0.25
BIAS = np.array([0.02, -0.015, 0.005])


def tool(time):
    """Where the tool is at a time: it moves all the while."""
    return np.array([0.5 + 0.2 * np.sin(time), 0.2 * np.cos(1.3 * time), 0.7])


def seen(stamp, bias=BIAS):
    """The `HandPoint` of vision that is wrong by a bias."""
    return np.array([stamp, 1.0, *(tool(stamp) + bias), 0.001, 4.0, 1.0])


def run(edge, until, measure, state=None, start=0.0):
    """The state at the end, and the reports of all cycles from ``start`` on; ``measure(stamp)`` is what vision sees."""
    state, reports = edge.initial_state() if state is None else state, []
    for cycle in range(round(start / PERIOD), round(until / PERIOD)):
        time = cycle * PERIOD
        state = edge.remember(state, time, tool(time))
        state = edge.update(state, time + 0.002, measure(time - LAG) if time >= LAG else np.zeros(8))
        reports.append(edge.report(state))
    return state, HandCorrection(np.array(reports).T)


def test_the_bias_is_recovered_while_the_hand_moves():
    edge = HandEyeCorrection()
    state, reports = run(edge, 2.0, seen)
    np.testing.assert_allclose(state.correction, BIAS, atol=1e-5)
    assert reports.used[0] == 0.0 and reports.used[-1] == 1.0
    assert reports.accepted[-1] > 100 and reports.rejected[-1] == 0
    target = np.zeros(message_size(ServoTarget))
    ServoTarget(target).valid = 1.0
    shifted = ServoTarget(edge.shifted(state, target))
    np.testing.assert_allclose([shifted.x, shifted.y, shifted.z], -BIAS, atol=1e-5)


def test_neither_the_correction_nor_its_rate_jumps():
    settings = HandEyeConfig()
    _, reports = run(HandEyeCorrection(settings), 2.0, seen)
    path = np.column_stack([reports.x, reports.y, reports.z])
    rate = np.linalg.norm(np.diff(path, axis=0), axis=1) / PERIOD
    assert rate.max() <= settings.largest_rate * 1.001
    assert np.abs(np.diff(rate)).max() < 0.4 * settings.largest_rate
    assert np.linalg.norm(path, axis=1).max() <= np.linalg.norm(BIAS) + 1e-9  # no overshoot


def test_outliers_are_refused_until_they_are_the_rule():
    edge = HandEyeCorrection()
    state, _ = run(edge, 1.5, seen)
    elsewhere = BIAS + [0.0, 0.03, 0.0]
    few, reports = run(edge, 1.5 + (OUTLIERS - 1.5) * PERIOD, lambda stamp: seen(stamp, elsewhere), state, 1.5)
    np.testing.assert_allclose(few.correction, BIAS, atol=1e-3)
    assert reports.rejected[-1] == OUTLIERS - 2 or reports.rejected[-1] == OUTLIERS - 1
    assert reports.reason[-1] == Doubt.OUTLIER
    many, _ = run(edge, 4.0, lambda stamp: seen(stamp, elsewhere), state, 1.5)
    np.testing.assert_allclose(many.correction, elsewhere, atol=1e-3)


@pytest.mark.parametrize(
    ("make", "doubt"),
    [
        (lambda stamp: seen(stamp, np.array([0.06, 0.0, 0.0])), Doubt.TOO_LARGE),
        (lambda stamp: seen(stamp, np.array([np.nan, 0.0, 0.0])), Doubt.NOT_FINITE),
        (lambda stamp: np.concatenate([[stamp + 1.0], seen(stamp)[1:]]), Doubt.UNKNOWN_TIME),
        (lambda stamp: np.concatenate([[stamp - 3.0], seen(stamp)[1:]]), Doubt.UNKNOWN_TIME),
    ],
)
def test_implausible_measurements_move_nothing(make, doubt):
    state, reports = run(HandEyeCorrection(), 1.0, make)
    assert not state.correction.any() and not reports.used.any()
    assert reports.accepted[-1] == 0 and reports.rejected[-1] > 20
    assert reports.reason[-1] == doubt
    assert describe_doubt(reports.reason[-1])


def test_the_correction_is_kept_for_a_while_and_then_fades():
    edge = HandEyeCorrection(variant(HandEyeConfig, keep=1.0)())
    state, _ = run(edge, 1.5, seen)
    kept, _ = run(edge, 2.3, lambda stamp: np.zeros(message_size(HandPoint)), state, 1.5)
    np.testing.assert_allclose(kept.correction, BIAS, atol=1e-3)
    assert kept.used
    faded, reports = run(edge, 4.0, lambda stamp: np.zeros(message_size(HandPoint)), state, 1.5)
    np.testing.assert_allclose(faded.correction, 0.0, atol=1e-4)
    assert not faded.used
    steps = np.abs(np.diff(np.column_stack([reports.x, reports.y, reports.z]), axis=0))
    assert steps.max() <= HandEyeConfig().largest_rate * PERIOD


def test_a_lossy_link_does_not_change_the_result():
    lost = np.random.default_rng(3).random(1000) < 0.6
    last = [np.zeros(message_size(HandPoint))]

    def held(stamp):  # the newest that arrived stays on the link
        if not lost[round(stamp / PERIOD)]:
            last[0] = seen(stamp)
        return last[0]

    state, reports = run(HandEyeCorrection(), 2.0, held)
    np.testing.assert_allclose(state.correction, BIAS, atol=1e-4)
    assert LEAST < reports.accepted[-1] < 60 and reports.rejected[-1] == 0


def test_nothing_is_shifted_without_a_target_or_where_the_scenario_says_so():
    state, _ = run(HandEyeCorrection(), 1.5, seen)
    target = np.arange(float(message_size(ServoTarget)))
    assert HandEyeCorrection(HandEyeConfig(correct=False)).shifted(state, target) is target
    target[ServoTarget.get_fields().index("valid")] = 0.0
    assert HandEyeCorrection().shifted(state, target) is target
