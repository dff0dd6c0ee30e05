"""A descent that lies ahead or is under way: what it relies on, where it will end, and whether it will succeed."""

import math
from typing import Any

import numpy as np

from drake_tracker.core.messages import evaluate_prediction
from drake_tracker.grasp.config import GraspConfig, touch_delay
from drake_tracker.grasp.prediction_memory import PredictionMemory, recent
from drake_tracker.grasp.success import Offset, no_surprise, success_probability

JUDGED_FOR = 1.5
"""Time [s] over which predictions are judged."""
RESPONSE = 0.06
"""Time [s] that a guided hand takes to follow a new packet."""
CATCHING_UP = 0.4
"""Speed [m/s] at which a guided hand can catch up with an object."""
BESIDE = 0.040
"""Height of the tool above the object [m] from which on the fingers are beside it."""


def horizon(config: GraspConfig, target: Any) -> float:
    """Returns the time [s] from the last measurement that the hand can follow to the instant at which the pads touch.

    In a blind descent this is the newest one at the launch. A guided hand follows measurements until shortly before the
    touch.

    Args:
        config: durations of the descent and the closing.
        target: a `ServoTarget`.
    """
    blind_time = RESPONSE if config.descent == "guided" else time_to_touch(config)
    return target.time - target.stamp + blind_time


def time_to_touch(config: GraspConfig) -> float:
    """Returns the time [s] from the launch to the instant at which the pads touch."""
    return config.descent_duration - config.closing_lead + touch_delay(config)


def likelihood(
    config: GraspConfig, memory: PredictionMemory, packet: np.ndarray, target: Any, remaining: float, height: float
) -> float:
    """Returns the probability that a grasp succeeds, 0 without a target.

    Args:
        config: durations, opening of the jaws, width of the object.
        memory: predictions made so far.
        packet: the newest `Prediction` vector.
        target: the `ServoTarget` that rests on it.
        remaining: time until the pads touch [s].
        height: height of the tool above the object [m].
    """
    if not target.valid:
        return 0.0
    offset = miss(packet, target, remaining, height <= BESIDE)
    judged, ahead = lately_judged(config, memory, target), horizon(config, target)
    probability = success_probability(config, packet, ahead, target.stamp, judged, offset)
    if config.descent != "guided":
        return probability
    x0, y0 = evaluate_prediction(packet, target.stamp)[:2]
    x, y = evaluate_prediction(packet, target.stamp + ahead)[:2]
    return probability * no_surprise(config, memory.records, ahead, math.hypot(x - x0, y - y0))


def lately_judged(config: GraspConfig, memory: PredictionMemory, target: Any) -> np.ndarray:
    """Returns the records on which the probability of a grasp rests, shape (n, 11)."""
    return recent(memory, target.stamp, JUDGED_FOR + horizon(config, target))


def miss(packet: np.ndarray, target: Any, remaining: float, beside: bool) -> Offset:
    """Returns by how much the hand will miss an object that moves as the newest packet predicts.

    The hand is where the servo's target is, and approaches the predicted path within `RESPONSE`, but not faster than
    with `CATCHING_UP`. Fingers that are already beside the object push it when they are moved across.

    Args:
        packet: the newest `Prediction` vector.
        target: the `ServoTarget`.
        remaining: time until the pads touch [s].
        beside: whether the fingers are as low as the object.
    """
    across, along, turn = behind(packet, target)
    remaining = max(remaining, 0.0)
    left = math.exp(-remaining / RESPONSE)
    distance = math.hypot(across, along)
    share = max(left, 1.0 - CATCHING_UP * remaining / distance) if distance > 0.0 else 0.0
    return Offset(across if beside else share * across, share * along, left * turn)


def behind(packet: np.ndarray, target: Any) -> Offset:
    """Returns the place of a `ServoTarget` relative to that which a `Prediction` vector predicts for the same time."""
    x, y, _, yaw, _ = evaluate_prediction(packet, target.time)
    dx, dy, c, s = target.x - x, target.y - y, math.cos(yaw), math.sin(yaw)
    return Offset(c * dy - s * dx, c * dx + s * dy, math.remainder(target.yaw - yaw, 2.0 * math.pi))
