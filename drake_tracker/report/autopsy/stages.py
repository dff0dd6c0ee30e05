"""The stages from the train to the jaws, in the order in which an error can come in."""

from enum import IntEnum


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
"""What a stage is called."""

MEANINGS = {
    Stage.VISION: "the motion centroids were off the train",
    Stage.TRIANGULATION: "the calibration put the centroids in the wrong place",
    Stage.FILTER: "the filter had a wrong idea of where the train was",
    Stage.PREDICTION: "the train did not go where it was predicted to go",
    Stage.LINK: "the arm worked with predictions older than the host's newest",
    Stage.SERVO: "the hand was not where the arm's computer sent it",
    Stage.TIMING: "the jaws closed at the wrong time for the descent",
}
"""What it means when a stage is to blame, as a clause."""

AXES = ("along", "across", "up", "yaw")
"""Columns of an array of contributions: [m] along the train's direction, to its left and up, and [rad]."""
