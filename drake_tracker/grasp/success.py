"""The probability that a grasp succeeds, from the distribution of the prediction and the tolerances of the jaws.

The jaws hold the object if, when the pads touch, it is between them, with both pads beside it and not too oblique. The
errors across and along the path and in direction are taken to be normal and independent.
"""

import math
from typing import Any

import numpy as np

from drake_tracker.core.messages import evaluate_prediction
from drake_tracker.grasp.config import GraspConfig, touch_delay

ALONG = 0.060
"""Largest error along the object at which the jaws still hold it [m]: half the length of a train."""
OBLIQUE = math.radians(25.0)
"""Largest error in direction at which the jaws turn the object instead of pushing it away [rad]."""
RESPONSE = 0.06
"""Time [s] that a guided hand takes to follow a new packet."""
SHORTEST = 0.01
"""Shortest distance travelled [m] from which an error in direction is derived."""


def guided_horizon(config: GraspConfig, target: Any) -> float:
    """Returns the time [s] between the newest measurement that can still correct a guided descent and the touch.

    Args:
        config: durations of the closing.
        target: a `ServoTarget`.
    """
    return target.time - target.stamp + RESPONSE + touch_delay(config)


def success_probability(config: GraspConfig, packet: np.ndarray, horizon: float, stamp: float) -> float:
    """Returns the probability that the jaws hold the object.

    The error in direction follows from that across the path: a wrong curvature displaces the end of a path by half of
    its length times the error in direction.

    Args:
        config: opening of the jaws and width of the object.
        packet: a `Prediction` vector.
        horizon: time from the measurement on which the hand relies to the touch [s].
        stamp: of the measurement [s].
    """
    x0, y0 = evaluate_prediction(packet, stamp)[:2]
    x, y, _, _, std = evaluate_prediction(packet, stamp + horizon)
    turn = 2.0 * std / max(math.hypot(x - x0, y - y0), SHORTEST)
    across = 0.5 * (config.jaw_opening - config.object_width)
    return _within(across, std) * _within(ALONG, std) * _within(OBLIQUE, turn)


def _within(limit: float, std: float) -> float:
    """Returns the probability that the magnitude of a normal error of a given standard deviation is below a limit."""
    return math.erf(limit / (math.sqrt(2.0) * std)) if std > 0.0 else 1.0
