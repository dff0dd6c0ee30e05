from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.core.messages import KNOT_COUNT, pack_prediction
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.corner_memory import (
    EVIDENCE,
    FEWEST_CORNERS,
    KNOWN_BY,
    after_corners,
    corners_due,
    is_repeated,
    is_restless,
    path_seen,
)
from drake_tracker.grasp.descent import Likelihood, Offset, is_wrong
from drake_tracker.grasp.gate import Gate, judge_probability
from drake_tracker.grasp.prediction_memory import ALONG, LATERAL, STAMP, PredictionMemory, X, Y
from tests.grasp.test_descent import target

AHEAD, PERIOD, SPEED, STRAIGHT = 0.2, 0.03, 0.1, 0.06
CUBE = GraspConfig(object_width=0.030, reach=0.015, turns=False, descent="guided", gate="probability")


def zigzag(travelled):
    """Places (n, 2) [m] on a path that turns by 90 deg to and fro after each `STRAIGHT`."""
    ends = np.array([[(k + 1) // 2, k // 2] for k in range(100)]) * STRAIGHT
    return np.column_stack([np.interp(travelled, STRAIGHT * np.arange(100), column) for column in ends.T])


def laps(travelled):
    """Places (n, 2) [m] on a square with sides of `STRAIGHT`."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * STRAIGHT
    s = travelled % (4.0 * STRAIGHT)
    return np.column_stack([np.interp(s, STRAIGHT * np.arange(5), column) for column in corners.T])


def straight(travelled):
    return np.column_stack([travelled, 0.0 * travelled])


def memory_of(path, length):
    """The memory of an object that travelled a length [m] on a path, and which of its predictions led to a miss: those
    that were due from 10 to 30 mm behind a corner."""
    stamps = np.arange(round(length / SPEED / PERIOD)) * PERIOD
    rows = np.zeros((len(stamps), 12))
    rows[:, STAMP] = stamps
    rows[:, [X, Y]] = path(SPEED * stamps)
    due = SPEED * (stamps + AHEAD)
    behind = due % STRAIGHT
    rows[(due > STRAIGHT) & (behind > 0.010) & (behind < 0.030), ALONG] = 0.03
    waiting = []
    for stamp in stamps[-1] + PERIOD * np.arange(1, round(AHEAD / PERIOD) + 1):
        place = path(np.array([SPEED * stamp]))[0]
        waiting.append(pack_prediction(stamp, 1, np.tile([*place, 0.47, 0.0, 0.002], (KNOT_COUNT, 1))))
    memory = PredictionMemory(tuple(waiting), rows)
    return memory, is_wrong(CUBE, rows)


def test_corners_are_found_where_they_are():
    memory, _ = memory_of(zigzag, 0.62)
    _, corners = corners_due(memory, path_seen(memory), AHEAD)
    assert corners - STRAIGHT * np.arange(1, 11) == pytest.approx(np.full(10, 0.010), abs=0.006)
    memory, _ = memory_of(straight, 0.6)
    assert len(corners_due(memory, path_seen(memory), AHEAD)[1]) == 0


@pytest.mark.parametrize(("behind", "good"), [(0.000, True), (0.020, False), (0.045, True)])
def test_a_touch_is_as_likely_as_behind_earlier_corners(behind, good):
    """The object has just been seen 20 mm behind a corner; the touch is due behind the next corner, or the one after
    it."""
    memory, wrong = memory_of(zigzag, 10 * STRAIGHT + 0.02)
    newest = path_seen(memory).travelled[-1] % STRAIGHT
    for corner in (1, 2):
        duration = (corner * STRAIGHT + behind - newest) / SPEED
        found = after_corners(memory, wrong, AHEAD, duration, 0.5)
        cases = 9 - corner
        expected = (cases * good + EVIDENCE * 0.5) / (cases + EVIDENCE)
        assert found == pytest.approx(expected, abs=0.03), corner


def test_without_corners_or_misses_or_on_a_known_path_the_other_probability_counts():
    for path, length, some in ((straight, 0.8, True), (zigzag, 0.8, False), (laps, 0.8, True), (zigzag, 0.2, True)):
        memory, wrong = memory_of(path, length)
        assert after_corners(memory, wrong & some, AHEAD, 0.6, 0.37) == 0.37
    assert FEWEST_CORNERS * STRAIGHT < 0.2


def test_a_path_is_repeated_when_a_piece_of_it_is_passed_again():
    for path, length, repeated in ((laps, 0.4, True), (laps, 0.2, False), (zigzag, 1.0, False), (straight, 1.0, False)):
        assert is_repeated(path_seen(memory_of(path, length)[0])) == repeated, (path, length)


@pytest.mark.parametrize(
    ("path", "length", "restless"),
    [(zigzag, KNOWN_BY + 0.1, True), (zigzag, KNOWN_BY - 0.1, False), (laps, 1.5, False), (straight, 1.5, False)],
)
def test_a_restless_object_is_grasped_at_its_best_moment(path, length, restless):
    """Not one that has travelled no farther than a lap, nor one that passes its own path again."""
    memory, wrong = memory_of(path, length)
    assert is_restless(memory, wrong, AHEAD) == restless
    calm = memory.records.copy()
    calm[calm[:, STAMP] > calm[-1, STAMP] - 4.0, ALONG] = 0.0
    assert not is_restless(memory, is_wrong(CUBE, calm), AHEAD), "no surprise lately"
    newest = target()
    newest.stamp = memory.records[-1, STAMP] + AHEAD
    newest.time = newest.stamp + AHEAD - 0.06
    for likely, best, verdict in (
        (0.5, 0.52, Gate.OPEN if restless else Gate.SUCCESS_UNLIKELY),
        (0.5, 0.6, Gate.SUCCESS_UNLIKELY),
        (0.3, 0.3, Gate.SUCCESS_UNLIKELY),
    ):
        assert judge_probability(CUBE, memory, newest, Likelihood(likely, likely), best) == verdict
    strict, nearly, likelier = replace(CUBE, launch_probability=0.9905), Likelihood(0.92, 0.92), Likelihood(0.95, 0.95)
    assert judge_probability(strict, memory, newest, nearly, 0.92) == Gate.SUCCESS_UNLIKELY
    assert judge_probability(strict, memory, newest, likelier, 0.95) == (
        Gate.OPEN if restless else Gate.SUCCESS_UNLIKELY
    )


def test_a_hand_that_is_elsewhere_misses_more():
    records = np.zeros((1, 12))
    records[0, LATERAL], records[0, ALONG] = 0.02, 0.01
    for offset, wrong in ((Offset(), False), (Offset(across=0.01), True), (Offset(across=-0.03), False)):
        assert is_wrong(CUBE, records, offset)[0] == wrong
    assert is_wrong(CUBE, records, Offset(along=0.006))[0] and not is_wrong(CUBE, records, Offset(along=-0.02))[0]
