"""The stages from the train to the jaws, in the order in which an error can occur."""

from enum import IntEnum

NORMAL_ATTEMPT = (0.010, 0.0002, 0.0001, 0.007, 0.0001, 0.006, 0.001)
"""Length of the contribution [m] to the offset when the jaws close."""
NORMAL_TRACKING = (0.016, 0.0002, 0.0001, 0.014, 0.0001, 0.008, 0.0001)
"""68th percentile of the lengths [m] while tracking."""


class Stage(IntEnum):
    """Rows of an array of contributions."""

    VISION = 0
    TRIANGULATION = 1
    FILTER = 2
    PREDICTION = 3
    LINK = 4
    SERVO = 5
    TIMING = 6


WORDS = {
    Stage.VISION: "vision",
    Stage.TRIANGULATION: "triangulation",
    Stage.FILTER: "filter",
    Stage.PREDICTION: "prediction",
    Stage.LINK: "link",
    Stage.SERVO: "servo",
    Stage.TIMING: "grasp timing",
}
"""Name of each stage."""

MEANINGS = {
    Stage.VISION: "the motion centroids were not on the train",
    Stage.TRIANGULATION: "the calibration mapped the centroids to the wrong points",
    Stage.FILTER: "the filtered state of the train was wrong",
    Stage.PREDICTION: "the train did not move as predicted",
    Stage.LINK: "the arm used predictions that were older than the host's newest one",
    Stage.SERVO: "the hand was not where the arm's controller sent it",
    Stage.TIMING: "the jaws closed at the wrong time of the descent",
}
"""The meaning of each stage as the main cause, as a clause."""

AXES = ("along", "across", "up", "yaw")
"""Columns of an array of contributions: along the train's direction of travel, to its left, and up [m]; yaw [rad]."""
