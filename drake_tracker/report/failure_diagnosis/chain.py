"""The offset of the hand from the train as a chain of differences, one for each stage, that add up exactly.

The chain leads through poses (x, y, z, yaw), from the true pose of the train to the pose of the hand. Three of them are
predictions of a healthy estimator for the same instant, see `yardstick`:

    the train                                        to   predicted from its true path             prediction
    predicted from its true path                     to   from centroids, cameras known            vision
    predicted from centroids, cameras known          to   from the points of the run               triangulation
    predicted from the points of the run             to   the same, from the filtered pose         filter
    the same, from the filtered pose                 to   the host's newest prediction             prediction
    the host's newest prediction                     to   the one that the arm followed            link
    the one that the arm followed                    to   the hand                                 servo

The first and the fifth belong to one stage: what no estimator could predict, and what the host predicted wrongly.
"""

from typing import NamedTuple

import numpy as np

from drake_tracker.core.messages import Prediction, evaluate_prediction
from drake_tracker.report.failure_diagnosis.stages import Stage


class Packets(NamedTuple):
    """The `Prediction` vectors behind one offset.

    Attributes:
        truly: the yardstick's, from the true path of the train; None where it was not ready.
        seen: the yardstick's, from the centroids and exactly known cameras; None where it was not ready.
        point: the yardstick's, from the points of the run; None where it was not ready.
        newest: the host's newest at the launch.
        held: the one that the arm followed.
    """

    truly: np.ndarray | None
    seen: np.ndarray | None
    point: np.ndarray | None
    newest: np.ndarray
    held: np.ndarray


def chain(packets: Packets, time: float, train: np.ndarray, hand: np.ndarray) -> np.ndarray:
    """Returns the contribution of each stage to ``hand`` minus ``train``: x, y, z [m, W] and yaw [rad], shape (7, 4).

    Its rows are those of `Stage`. They add up to the difference exactly; its yaw is exact up to half turns, which leave
    the jaws unchanged. The row of `Stage.TIMING` is zero. Without a yardstick, the contributions of vision and
    triangulation are part of the filter's.

    Args:
        packets: evaluated at ``time``.
        time: [s].
        train: pose of the train (x, y, z, yaw).
        hand: pose of the hand (x, y, z, yaw), minus its intended height above the train.
    """
    stamp = Prediction(packets.newest).stamp
    newest, held = (evaluate_prediction(packet, time)[:4] for packet in (packets.newest, packets.held))
    filtered = evaluate_prediction(packets.newest, stamp)[:4]
    if packets.truly is None or packets.seen is None or packets.point is None:
        truly = seen = point = set_off = train
    else:
        yardsticks = (packets.truly, packets.seen, packets.point)
        truly, seen, point = (evaluate_prediction(packet, time)[:4] for packet in yardsticks)
        set_off = _set_off(filtered, evaluate_prediction(packets.point, stamp)[:4], point)
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


def in_train(rows: np.ndarray, yaw: float) -> np.ndarray:
    """Returns contributions (n, 4) in W as (along, across, up, yaw) in the frame of the train.

    Args:
        rows: x, y, z [m, W], yaw [rad], shape (n, 4).
        yaw: direction of travel of the train [rad].
    """
    cos, sin = np.cos(yaw), np.sin(yaw)
    along, across = cos * rows[:, 0] + sin * rows[:, 1], cos * rows[:, 1] - sin * rows[:, 0]
    return np.column_stack([along, across, rows[:, 2], rows[:, 3]])


def _set_off(filtered: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Returns the end of the path from ``start`` to ``end`` when it starts at the pose ``filtered`` instead."""
    turn = filtered[3] - start[3]
    cos, sin = np.cos(turn), np.sin(turn)
    dx, dy, dz, dyaw = end - start
    return filtered + [cos * dx - sin * dy, sin * dx + cos * dy, dz, dyaw]


def _turned_to(pose: np.ndarray, yaw: float) -> np.ndarray:
    """Returns a pose with its yaw changed by whole turns to within half a turn of ``yaw``."""
    pose = np.array(pose, dtype=float)
    pose[3] += 2.0 * np.pi * np.round((yaw - pose[3]) / (2.0 * np.pi))
    return pose
