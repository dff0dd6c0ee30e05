"""The probability that a grasp succeeds, from the distribution of the prediction and the tolerances of the jaws.

The jaws hold the object if, when the pads touch, it is between them, with both pads beside it and not too oblique. The
errors across and along the path and in direction are taken to be normal and independent.
"""

import math

import numpy as np

from drake_tracker.core.messages import evaluate_prediction
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.prediction_memory import ALONG, LATERAL, TURN

REACH = 0.060
"""Largest error along the path at which the jaws still hold a train [m]: half of its length."""
OBLIQUE = math.radians(25.0)
"""Largest error in direction at which the jaws turn the object instead of pushing it away [rad]."""
RESPONSE = 0.06
"""Time [s] that a guided hand takes to follow a new packet."""
FEWEST_RECORDS = 10
"""Fewest judged predictions from which a probability is computed."""
JUDGED_FOR = 1.5
"""Time [s] over which predictions are judged."""
SHORTEST = 0.01
"""Distance [m] from which on the direction of travel follows from the path; an object that stands keeps its own."""


def success_probability(
    config: GraspConfig, packet: np.ndarray, horizon: float, stamp: float, judged: np.ndarray
) -> float:
    """Returns the probability that the jaws hold the object, 0 while too few predictions have been judged.

    The variance of each error is that which the estimator predicts, plus the mean square of the errors that its recent
    predictions turned out to have. The estimator's error in direction follows from that across the path: a wrong
    curvature displaces the end of a path by half of its length times the error in direction.

    Args:
        config: opening of the jaws and width of the object.
        packet: a `Prediction` vector.
        horizon: time from the measurement on which the hand relies to the touch [s].
        stamp: of the measurement [s].
        judged: records of recent predictions for this horizon, shape (n, 10), as from `prediction_memory.recent`.
    """
    if len(judged) < FEWEST_RECORDS:
        return 0.0
    x0, y0 = evaluate_prediction(packet, stamp)[:2]
    x, y, _, _, std = evaluate_prediction(packet, stamp + horizon)
    travelled = math.hypot(x - x0, y - y0)
    turn = 2.0 * std / travelled if travelled > SHORTEST else 0.0
    across, along, oblique = np.sqrt(np.mean(judged[:, [LATERAL, ALONG, TURN]] ** 2, axis=0))
    room = 0.5 * (config.jaw_opening - config.object_width)
    return (
        _within(room, math.hypot(std, across))
        * _within(REACH, math.hypot(std, along))
        * _within(OBLIQUE, math.hypot(turn, oblique))
    )


def _within(limit: float, std: float) -> float:
    """Returns the probability that the magnitude of a normal error of a given standard deviation is below a limit."""
    return math.erf(limit / (math.sqrt(2.0) * std)) if std > 0.0 else 1.0
