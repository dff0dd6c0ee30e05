"""The offset of the hand from the train as a chain of differences, one for each stage, that adds up exactly.

The chain leads through poses (x, y, z, yaw) from where the train truly is to where the hand is. Three of them are what
a healthy estimator would have predicted for the same instant, see `replay`:

    the train                                        to   predicted from its true way          prediction
    predicted from its true way                      to   from centroids, cameras known        vision
    predicted from centroids, cameras known          to   from the points of the run           triangulation
    predicted from the points of the run             to   the same, from the filtered pose     filter
    the same, from the filtered pose                 to   the host's newest prediction         prediction
    the host's newest prediction                     to   the one that the arm followed        link
    the one that the arm followed                    to   the hand                             servo

The first and the fifth are one stage: what nobody could foresee, and what the host foresaw wrongly.
"""

from typing import NamedTuple

import numpy as np

from drake_tracker.core.messages import evaluate_prediction
from drake_tracker.report.autopsy.stages import Stage


class Packets(NamedTuple):
    """The `Prediction` vectors on which one offset rests.

    ``truly``, ``seen``, ``point``: the yardstick's, on the train's true way, on the centroids through cameras that are
    known exactly, and on the points of the run; None where it was not ready. ``newest``: the host's newest at the
    launch. ``held``: the one that the arm followed.
    """

    truly: np.ndarray | None
    seen: np.ndarray | None
    point: np.ndarray | None
    newest: np.ndarray
    held: np.ndarray


def chain(packets, time, train, hand):
    """Returns what each stage contributed to ``hand`` minus ``train``, shape (7, 4): rows of `Stage`, columns x, y, z
    [m, W] and yaw [rad].

    The rows add up to the difference exactly, its yaw but for half turns, after which the jaws are what they were.
    `Stage.TIMING` is zero here. Without a yardstick, vision and triangulation count to the filter.

    Args:
      packets: `Packets`. time: the instant [s] for which all of them are read. train, hand: poses (x, y, z, yaw), the
      hand's less the height at which it is meant to be above the train.
    """
    newest, held = (evaluate_prediction(packet, time)[:4] for packet in (packets.newest, packets.held))
    filtered = evaluate_prediction(packets.newest, packets.newest[0])[:4]
    if any(packet is None for packet in packets[:3]):
        truly = seen = point = set_off = train
    else:
        truly, seen, point = (evaluate_prediction(packet, time)[:4] for packet in packets[:3])
        set_off = _set_off(filtered, evaluate_prediction(packets.point, packets.newest[0])[:4], point)
    hand = np.array(hand, dtype=float)
    hand[3] += np.pi * np.round((train[3] - hand[3]) / np.pi)
    steps = (
        (Stage.PREDICTION, truly),
        (Stage.VISION, seen),
        (Stage.TRIANGULATION, point),
        (Stage.FILTER, set_off),
        (Stage.PREDICTION, newest),
        (Stage.LINK, held),
        (Stage.SERVO, hand),
    )
    rows = np.zeros((len(Stage), 4))
    before = np.asarray(train, dtype=float)
    for stage, pose in steps:
        pose = _turned_to(pose, train[3])
        rows[stage] += pose - before
        before = pose
    return rows


def in_train(rows, yaw):
    """Returns contributions (n, 4) in W as (along, across, up, yaw) of a train that drives in the direction ``yaw``."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    along, across = cos * rows[:, 0] + sin * rows[:, 1], cos * rows[:, 1] - sin * rows[:, 0]
    return np.column_stack([along, across, rows[:, 2], rows[:, 3]])


def _set_off(filtered, start, end):
    """Returns where the way from ``start`` to ``end`` leads when it sets off from the pose ``filtered``."""
    turn = filtered[3] - start[3]
    cos, sin = np.cos(turn), np.sin(turn)
    dx, dy, dz, dyaw = end - start
    return filtered + [cos * dx - sin * dy, sin * dx + cos * dy, dz, dyaw]


def _turned_to(pose, yaw):
    """Returns a pose with its yaw moved by whole turns to within half a turn of ``yaw``."""
    pose = np.array(pose, dtype=float)
    pose[3] += 2.0 * np.pi * np.round((yaw - pose[3]) / (2.0 * np.pi))
    return pose
