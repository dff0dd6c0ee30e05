"""What the log of a run says about vision during the descent, for `eyes_open.py`."""

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import during, tool_pose
from drake_tracker.tasks.train.episode import errors, train_pose

LOWEST = -0.02
"""Least height of the tool above the middle of the train [m]."""


def points_at(signal):
    """Returns (stamps (n,), points (n, 3)) of a signal's valid measurements in W [s, m], each stamp once."""
    valid = signal["valid"] > 0
    stamps, first = np.unique(signal["stamp"][valid], return_index=True)
    return stamps, signal.view("x", "y", "z")[valid][first]


def above(log, spans, times, height):
    """Returns at which times the hand sees the train below it, shape (n,), bool, until a finger touches it.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
        times: shape (n,) [s].
        height: largest height of the tool above the middle of the train [m].
    """
    verdict = log["truth_verdict"]
    touched = (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)
    latest = np.clip(np.searchsorted(verdict.times, times, side="right") - 1, 0, None)
    tool = tool_pose(log, times)[:, 2] - train_pose(log, times)[:, 2]
    free = during(spans, times, Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE) & ~touched[latest]
    return free & (tool >= LOWEST) & (tool < height)


def relative_errors(log, spans, height):
    """Returns the horizontal error of the vector from the hand to the train, from a height on, as a list [m].

    With markers on the hand, both are taken from the same images. Without, the hand is where its joints tell.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
        height: largest height of the tool above the middle of the train [m].
    """
    stamps, points = points_at(log["point"])
    error = (points - train_pose(log, stamps)[:, :3])[:, :2]
    if "hand_point" in log:
        seen, hands = points_at(log["hand_point"])
        _, at_point, at_hand = np.intersect1d(
            *(np.round(each / VISION_PERIOD).astype(int) for each in (stamps, seen)), return_indices=True
        )
        wrong = (hands - tool_pose(log, seen)[:, :3])[at_hand, :2]
        stamps, error = stamps[at_point], error[at_point] - wrong
    return np.hypot(*error[above(log, spans, stamps, height)].T).tolist()


def place_errors(log, spans, height):
    """Returns the errors of the train's position along and across its path, from a height on, and how often it is seen.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
        height: largest height of the tool above the middle of the train [m].

    Returns (list of [along, across] [m], number of cycles of the vision from this height on).
    """
    stamps, points = points_at(log["point"])
    below = above(log, spans, stamps, height)
    cycles = np.arange(0.0, log["truth_verdict"].times[-1], VISION_PERIOD)
    return errors(log, stamps, points[:, :2])[below].tolist(), int(above(log, spans, cycles, height).sum())
