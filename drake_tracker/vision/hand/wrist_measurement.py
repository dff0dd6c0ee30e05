"""Input and output of a camera on the hand: the expected object, and its measurement."""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

DRIFT = 3.5
"""Standard deviations by which the fixed cameras may disagree, beside `DRIFT_FLOOR`."""
DRIFT_FLOOR = 0.008
"""Disagreement with the fixed cameras that is always tolerated [m]."""


class WristReason(IntEnum):
    """Why there is no measurement of the camera on the hand."""

    VALID = 0
    NO_IMAGE = 1
    NO_PREDICTION = 2
    DARK = 3
    OUT_OF_VIEW = 4
    NOT_LEARNED = 5
    POOR_MATCH = 6
    AT_THE_EDGE = 7
    DISAGREES = 8
    JAWS_CLOSED = 9


class Expectation(NamedTuple):
    """Where the host predicts the object at the capture of an image.

    Attributes:
        p_WQ: its reference point, shape (3,) [m].
        yaw: its direction of travel [rad].
    """

    p_WQ: np.ndarray
    yaw: float


class FixedPoint(NamedTuple):
    """Measurement of the fixed cameras at the same stamp.

    Attributes:
        p_WQ: shape (3,) [m].
        covariance: shape (3, 3) [m^2].
        length: largest dimension of the object [m].
    """

    p_WQ: np.ndarray
    covariance: np.ndarray
    length: float


class WristMeasurement(NamedTuple):
    """Result of one image of the camera on the hand.

    Attributes:
        reason: `WristReason.VALID`, or why there is no measurement.
        p_WQ: the object's reference point, shape (3,) [m].
        covariance: of it, shape (3, 3) [m^2].
        correlation: of the image with the template, -1 to 1.
    """

    reason: WristReason
    p_WQ: np.ndarray
    covariance: np.ndarray
    correlation: float = 0.0


def nothing(reason: WristReason, correlation: float = 0.0) -> WristMeasurement:
    """Returns a measurement without a place.

    Args:
        reason: why there is none.
        correlation: of the image with the template.
    """
    return WristMeasurement(reason, np.zeros(3), np.zeros((3, 3)), correlation)


def disagree(p_WQ: np.ndarray, covariance: np.ndarray, fixed: FixedPoint) -> bool:
    """Returns whether a measurement contradicts the measurement of the fixed cameras, horizontally."""
    difference = p_WQ[:2] - fixed.p_WQ[:2]
    distance = float(np.hypot(*difference))
    if distance <= DRIFT_FLOOR:
        return False
    direction = difference / distance
    variance = direction @ (covariance + fixed.covariance)[:2, :2] @ direction
    return bool(distance > DRIFT_FLOOR + DRIFT * math.sqrt(variance))
